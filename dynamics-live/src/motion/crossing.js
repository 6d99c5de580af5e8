// Steps across positions at which the constraint Jacobian nearly loses rank, where branches of a mechanism
// may meet: change points. The theory is in `dynamics-runtime/src/integrate/stepper/singularity_crossing.rs`.
//
// Fixed steps whose stages disagree by many times their usual disagreement are divided, so that the stages
// lie elsewhere. Under step control ends that rounding makes uncertain are avoided, and of those that cannot
// be avoided the best is taken.

/** Further attempts at a step near rank loss, each with other stages and another end. */
const MAX_RETRIES = 5;
/** Under step control each retry is this factor times as long as the one before. */
const RETRY_FACTOR = 0.8;
/** Ends of the retries of a fixed step: at a part of what is left of it, and a part of a fixed step later. */
const RETRY_ENDS = [
  [1, 0.3],
  [0.8, 0],
  [1, 0.15],
  [0.6, 0],
  [0.4, 0],
];
/** A fixed step is inspected whose stages disagree by so many times their usual disagreement, ... */
const UNUSUAL_DISAGREEMENT = 30;
/** ... which follows that of the last step by no more than this factor. */
const USUAL_CHANGE = 2;
/** Stages that disagree by less, in permitted errors, do so by rounding. */
const ROUNDING_DISAGREEMENT = 0.1;
/** An error this large, in permitted errors, comes from stages off the constraints. */
const OFF_CONSTRAINT_ERROR = 30;
/** The end of a shorter step replaces a longer one only if its uncertainty is smaller by this factor. */
const PREFERRED_CERTAINTY = 4;
/** Condition of the constraints above which a singular position may be near. */
const NEARLY_SINGULAR_CONDITION = 5;

/** What is kept from one attempt to the next, and from one fixed step to the next. */
class SingularityCrossing {
  constructor() {
    /** Usual disagreement of the stages of fixed steps; 0 where it is not known. */
    this.usual = 0;
    this.disagreement = 0;
    this.begin_step();
  }

  begin_step() {
    this.best = null;
    this.best_uncertain = null;
    this.is_last = false;
  }

  /**
   * What to do with an attempt at a fixed step: `accept`, `best` where it is accepted although its stages
   * disagree, or the number of the retry that follows. `near()`: whether it is near rank loss.
   */
  judge(attempt, disagreement, near) {
    this.disagreement = disagreement;
    const is_usual = this.usual > 0 && disagreement <= UNUSUAL_DISAGREEMENT * this.usual;
    const is_first = this.usual === 0 && Number.isFinite(disagreement);
    if (is_usual || is_first || (attempt === 0 && this.best === null && !near())) return "accept";
    if (this.is_last) return "best";
    if (this.best === null || disagreement < this.best.disagreement) this.best = { attempt, disagreement };
    if (attempt < RETRY_ENDS.length) return attempt + 1;
    this.is_last = true;
    return this.best.attempt === attempt ? "best" : this.best.attempt;
  }

  /** Updates the usual disagreement after a whole fixed step. */
  update_usual() {
    if (!Number.isFinite(this.disagreement)) return;
    const found = Math.max(this.disagreement, ROUNDING_DISAGREEMENT),
      { usual } = this;
    this.usual = usual === 0 ? found : Math.min(Math.max(found, usual / USUAL_CHANGE), usual * USUAL_CHANGE);
  }

  /** Whether an attempt under step control is repeated elsewhere, after `retries` of them. */
  needs_retry(retries, to, error, noise) {
    if (!(noise > 1 || error > OFF_CONSTRAINT_ERROR) || this.is_last) return false;
    const least = this.best_uncertain;
    if (error <= 1 && (least === null || PREFERRED_CERTAINTY * noise < least.noise)) {
      this.best_uncertain = { to, noise };
    }
    return retries < MAX_RETRIES;
  }

  /** The end of an earlier attempt that was better than the last one, or null. */
  better_end(retries, to, error, noise) {
    const best = this.best_uncertain;
    this.best_uncertain = null;
    if (best === null) return null;
    const is_uncertain = noise > 1 && best.noise <= PREFERRED_CERTAINTY * noise;
    const is_better = best.to !== to && (is_uncertain || (error > 1 && retries === MAX_RETRIES));
    if (is_better) this.is_last = true;
    return is_better ? best.to : null;
  }
}
