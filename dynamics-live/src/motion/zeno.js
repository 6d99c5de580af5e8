// Zeno accumulation: events that follow each other in ever shorter intervals whose sum is finite. The theory
// is in `dynamics-runtime/src/simulate/events/zeno.rs`.

/** Times in a row that an event may happen at one instant. */
const MAX_EVENTS_AT_ONE_INSTANT = 16;
/** Smallest power p for which intervals that shrink as n⁻ᵖ have a finite sum here. */
const MIN_SUMMABLE_POWER = 1.5;
/** Intervals up to this many units in the last place of the time are one instant. */
const MAX_ULPS_OF_ONE_INSTANT = 16;
/** Fewest intervals in a row, each shorter than the one before, that count as an accumulation. */
const MIN_SHRINKING_INTERVALS = 8;
/** Last interval, in parts of the first one, below which shrinking intervals accumulate. */
const ACCUMULATED_INTERVAL = 1e-6;

Object.assign(FAILURES, {
  events_accumulate: ({ name, at, squeezed, contact }) =>
    squeezed
      ? `event \`${name}\` happens in ever shorter time and ever faster, without end before about ` +
        `t = ${rounded(at)}: what lies between contacts that approach each other is squeezed; let what ` +
        `moves stop before, make a contact compliant, or end the motion before`
      : `event \`${name}\` happens in ever shorter time and accumulates at about t = ${rounded(at)}; ` +
        remedy_for_repetition(contact),
});

/** Finds the accumulation of one event. */
class Zeno {
  constructor() {
    this.last_time = NaN;
    this.first_interval = 0;
    this.interval = 0;
    this.shrinking = 0;
    /** Two earlier intervals with their numbers: the last two whose number is a power of two. */
    this.marks = [
      [0, 0],
      [0, 0],
    ];
    this.events_at_instant = 0;
    /** Speed of the hit at which the intervals began to shrink. */
    this.first_speed = 0;
  }

  /**
   * Notes an event at a time, in a step of size h, with the speed of a contact's hit, 0 for others. Returns
   * null, or where the events accumulate: { at, squeezed }.
   */
  note_event(t, h, speed) {
    const { last_time } = this;
    this.last_time = t;
    if (Number.isNaN(last_time)) return null;
    const interval = Math.abs(t - last_time);
    if (interval <= MAX_ULPS_OF_ONE_INSTANT * Number.EPSILON * Math.abs(t)) {
      this.events_at_instant++;
      return this.events_at_instant < MAX_EVENTS_AT_ONE_INSTANT ? null : { at: t, squeezed: false };
    }
    if (interval < this.interval) {
      this.shrinking++;
    } else {
      [this.first_interval, this.first_speed, this.shrinking] = [interval, speed, 0];
      this.marks = [
        [1, interval],
        [1, interval],
      ];
    }
    if (this.shrinking === 2 * this.marks[1][0]) this.marks = [this.marks[1], [this.shrinking, interval]];
    const ratio = interval / this.interval;
    [this.interval, this.events_at_instant] = [interval, 0];
    const accumulates =
      this.shrinking >= MIN_SHRINKING_INTERVALS &&
      interval < ACCUMULATED_INTERVAL * this.first_interval &&
      this.decay_power() > MIN_SUMMABLE_POWER;
    if (!accumulates) return null;
    const squeezed = speed > this.first_speed;
    const left = squeezed
      ? interval / ratio / (1 - Math.sqrt(ratio)) - interval - interval / ratio
      : (interval * ratio) / (1 - ratio);
    return { at: t + (h < 0 ? -left : left), squeezed };
  }

  /**
   * The power p of their number n with which intervals shrink, n⁻ᵖ, over at least the last half of them.
   */
  decay_power() {
    const [number, interval] = this.marks[0];
    return Math.log(interval / this.interval) / Math.log(this.shrinking / number);
  }
}
