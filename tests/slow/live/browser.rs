//! Live pages in a browser: what a reader sees, touches and hears.
//!
//! Every test visits all pages of `pages`. They need Chromium (`DYNAMICS_CHROMIUM`, or one on the path), and
//! are skipped without one unless `DYNAMICS_BROWSER=1`.

mod driver;
mod page;
mod pages;

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::OnceLock;

use serde_json::json;

use driver::{Chromium, kill};
use page::{DESK, Opening, PHONE, Page, STILL};
use pages::{File, files};

/// Checks every file; all that is wrong is told at the end.
fn visit(
    files: impl IntoIterator<Item = &'static File>,
    opening: Opening,
    check: impl Fn(&Chromium, &File, &Page<'_>) -> Vec<String>,
) {
    let Some(browser) = Chromium::start() else { return };
    let (mut wrong, mut visited) = (Vec::new(), 0);
    for file in files {
        visited += 1;
        let page = Page::open(&browser, &file.address, opening);
        let mut found = check(&browser, file, &page);
        found.extend(page.complaints());
        wrong.extend(found.into_iter().map(|text| format!("{}: {text}", file.name)));
    }
    assert!(wrong.is_empty() && visited > 0, "{visited} visited\n{}", wrong.join("\n"));
}

/// Files that move.
fn live_files() -> impl Iterator<Item = &'static File> {
    files().iter().filter(|file| file.live)
}

/// A text where a condition fails.
fn unless(condition: bool, text: impl Into<String>) -> Option<String> {
    (!condition).then(|| text.into())
}

/// They play, nothing stands out of the window, and (by `visit`) nothing is thrown, logged or requested.
#[test]
fn pages_play_silently_and_fit() {
    visit(files(), Opening { still: false, ..STILL }, |_, file, page| {
        let plays = !file.live || page.becomes("live.frames > 20 && live.player.head > 0");
        let mut wrong: Vec<_> = unless(plays, "does not play").into_iter().collect();
        if file.live {
            let first = page.number("performance.getEntriesByType('paint').at(-1).startTime");
            let frame = page.number("live.spent / live.frames");
            eprintln!("{}: first paint after {first:.0} ms, {frame:.2} ms of script per frame", file.name);
        }
        page.evaluate("tests.unfold()");
        // Besides a desk and a phone: a phone across, and the narrowest window of WCAG 2.2, 1.4.10.
        for size in [DESK, PHONE, [844, 390], [320, 640]] {
            page.resize(size);
            page.draws();
            let beside = page.texts("tests.beside()");
            wrong.extend(beside.into_iter().map(|text| format!("at {size:?} beside: {text}")));
        }
        wrong
    });
}

#[test]
fn less_motion_does_not_start() {
    visit(live_files(), STILL, |_, _, page| {
        page.evaluate("tests.frames(20)");
        let still = page.is("!live.player.playing && live.player.head === 0");
        unless(still, "starts by itself").into_iter().collect()
    });
}

/// Names in the accessibility tree, which tell controls apart.
#[test]
fn controls_have_names() {
    const ROLES: [&str; 8] =
        ["application", "button", "checkbox", "combobox", "DisclosureTriangle", "link", "slider", "textbox"];
    visit(files(), STILL, |_, _, page| {
        page.evaluate("tests.unfold()");
        let tree = page.call("Accessibility.getFullAXTree", json!({}));
        let mut names = BTreeMap::new();
        for node in tree["nodes"].as_array().unwrap() {
            let role = node["role"]["value"].as_str().unwrap_or_default();
            if node["ignored"] == false && ROLES.contains(&role) {
                let name = node["name"]["value"].as_str().unwrap_or_default().trim().to_owned();
                *names.entry((role.to_owned(), name)).or_insert(0) += 1;
            }
        }
        let count = names.values().sum::<usize>();
        let controls = page.number("tests.controls().length") as usize;
        let all = unless(count >= controls, format!("{count} names, {controls} controls"));
        let mut wrong: Vec<_> = all.into_iter().collect();
        for ((role, name), times) in names {
            wrong.extend(unless(
                !name.is_empty() && times == 1,
                format!("{times} of role {role} named “{name}”"),
            ));
        }
        wrong
    });
}

/// Forwards and back, on a desk and on a phone, where the picture stays above what scrolls.
#[test]
fn the_tab_key_reaches_every_control() {
    visit(files(), STILL, |_, _, page| {
        let count = page.number("tests.track()") as usize;
        let mut wrong = Vec::new();
        for (size, back) in [(DESK, false), (DESK, true), (PHONE, false), (PHONE, true)] {
            page.resize(size);
            page.evaluate("tests.met.clear()");
            page.draws();
            for _ in 0..count + 10 {
                page.press_with("Tab", back);
                if page.is("tests.meets()") {
                    break;
                }
            }
            let way = if back { "back" } else { "forwards" };
            for (list, what) in
                [("tests.missed()", "not reached"), ("tests.hidden.splice(0)", "out of sight")]
            {
                let controls = page.texts(&format!("{list}.map(tests.words)"));
                wrong.extend(controls.into_iter().map(|words| format!("at {size:?} {way} {what}: {words}")));
            }
        }
        wrong
    });
}

#[test]
fn keys_play_scrub_and_restart() {
    visit(live_files(), STILL, |_, _, page| {
        let mut wrong = Vec::new();
        page.press(" ");
        let goes_on = "live.player.head > 20 || live.player.reason";
        let plays = page.is("live.player.playing") && page.becomes(goes_on);
        wrong.extend(unless(plays, "space does not play"));
        if page.is("live.player.playing") {
            page.press(" ");
        }
        wrong.extend(unless(page.is("!live.player.playing"), "space does not pause"));
        for (key, by) in [("ArrowLeft", -6.0), (".", 1.0), (",", -1.0), (",", -1.0), ("ArrowRight", 6.0)] {
            let [before, first] = ["live.player.head", "live.player.first"].map(|of| page.number(of));
            page.press(key);
            let after = page.number("live.player.head");
            let ended = page.is("Boolean(live.player.reason)");
            let moved =
                (after - (before + by).max(first)).abs() < 1e-9 || by > 0.0 && ended && after >= before;
            wrong.extend(unless(moved, format!("{key} goes from {before} to {after}")));
        }
        page.press("r");
        let back = "live.player.head === 0 && live.player.time() === live.player.start.t";
        wrong.extend(unless(page.is(back), "R does not go back to the start"));
        wrong
    });
}

/// A point follows the pointer or the finger to places that it can reach, and flies on.
#[test]
fn a_dragged_point_follows() {
    for size in [DESK, PHONE] {
        let finger = size == PHONE;
        visit(live_files(), Opening { size, ..STILL }, |_, file, page| {
            page.evaluate("tests.reachable()");
            page.evaluate("tests.settled()");
            let time = page.number("live.player.time()");
            let found = page.evaluate("tests.dragged()");
            if found.is_null() {
                eprintln!("{}: no point moves", file.name);
                return Vec::new();
            }
            let place = |value: &serde_json::Value| [0, 1].map(|axis| value[axis].as_f64().unwrap());
            let (from, to) = (place(&found["from"]), place(&found["to"]));
            page.pointer("pressed", from, finger);
            for step in 1..=16 {
                let part = f64::from(step.min(12)) / 12.0;
                let at = [0, 1].map(|axis| from[axis] + part * (to[axis] - from[axis]));
                page.pointer("moved", at, finger);
                page.draws();
            }
            let mut wrong = Vec::new();
            if page.is("live.picture.held === null") {
                let [x, y] = from;
                let seen = page.texts(&format!("[tests.words(document.elementFromPoint({x}, {y}))]"));
                wrong.push(format!("at {size:?} {} is not held; there is {seen:?}", found["name"]));
            } else {
                let at = place(&page.evaluate("tests.heldAt()"));
                let off = (at[0] - to[0]).hypot(at[1] - to[1]);
                let (name, way) = (&found["name"], &found["way"]);
                wrong.extend(unless(
                    off < 2.0,
                    format!("at {size:?} {name} is {off:.1} px off after {way} px"),
                ));
            }
            let stays = page.number("live.player.start.t") == time;
            wrong.extend(unless(stays, "is another time under the finger"));
            page.pointer("released", to, finger);
            let goes_on = page.becomes("live.player.playing || live.player.reason");
            wrong.extend(unless(goes_on, "does not go on"));
            wrong
        });
    }
}

/// Every slider changes its number in the address, or says why not; one of the parameters changes the motion.
#[test]
fn sliders_change_motion_and_address() {
    visit(live_files(), STILL, |_, _, page| {
        page.evaluate("tests.unfold()");
        let mut wrong = Vec::new();
        let (mut parameters, mut moved) = (0, 0);
        for id in page.texts("tests.sliders()") {
            let before = page.texts("[live.link(), tests.later(live.player.pace)]");
            page.evaluate(&format!("tests.of('{id}').focus()"));
            for key in ["ArrowRight", "ArrowLeft"] {
                page.press(key);
                if page.texts("[live.link()]")[0] != before[0] {
                    break;
                }
            }
            let after = page.texts("[live.link(), tests.later(live.player.pace)]");
            let told = page.texts(&format!("[tests.refusal('{id}')]")).remove(0);
            let free = before[0] != after[0] || !told.is_empty();
            wrong.extend(unless(free, format!("{id} changes nothing, without a word")));
            let held = !told.starts_with("held") || page.is(&format!("tests.isHeld('{id}')"));
            wrong.extend(unless(held, format!("{id} is not {told}")));
            let stale = page.texts("tests.staleStarts()");
            wrong.extend(stale.into_iter().map(|other| format!("{other} is stale after {id}")));
            if id.starts_with('p') {
                parameters += 1;
                moved += usize::from(before[1] != after[1]);
            }
        }
        wrong.extend(unless(parameters == 0 || moved > 0, "no parameter changes the motion"));
        let follows = page.becomes("location.hash === '#' + live.link()");
        wrong.extend(unless(follows, "the address does not follow"));
        wrong
    });
}

/// A fresh tab at the address of a page has its state and its motion, bit for bit.
#[test]
fn addresses_keep_the_last_digit() {
    visit(live_files(), STILL, |browser, _, page| {
        // Numbers of all digits: a point that was moved by keys.
        page.evaluate("tests.of('picture').focus()");
        for key in ["ArrowRight", "ArrowUp"] {
            page.press(key);
        }
        let slider = page.texts("tests.sliders()").into_iter().find(|id| id.starts_with('p'));
        if let Some(id) = slider {
            page.evaluate(&format!("tests.of('{id}').focus()"));
            page.press("ArrowRight");
        }
        if !page.becomes("location.hash === '#' + live.link()") {
            return vec!["the address does not follow".to_owned()];
        }
        let address = page.texts("[location.href]").remove(0);
        let fresh = Page::open(browser, &address, STILL);
        let mut wrong = fresh.complaints();
        // Paces are measured, and may differ.
        let later = format!("tests.later({})", page.number("live.player.pace"));
        for what in ["tests.state()", &later] {
            let (old, new) = (page.evaluate(what), fresh.evaluate(what));
            wrong.extend(unless(old == new, format!("{what} is {old}, and by its address {new}")));
        }
        wrong
    });
}

/// The ends that the user gave are met, and stay.
#[test]
fn given_ends_of_sliders_are_met() {
    visit(live_files().filter(|file| file.name == "pendulum"), STILL, |_, _, page| {
        let mut wrong = Vec::new();
        page.evaluate("tests.of('p2').focus()");
        for (key, end) in
            [("PageDown", 9.7805), ("PageUp", 9.8325), ("ArrowDown", 9.83198), ("PageDown", 9.7805)]
        {
            for _ in 0..if key == "ArrowDown" { 1 } else { 12 } {
                page.press(key);
            }
            let g = page.number("live.player.motion.p[2]");
            wrong.extend(unless((g - end).abs() < 1e-4, format!("{key} goes to {g} instead of {end}")));
        }
        wrong
    });
}

/// A page lives after any link: what is refused leaves the page's own start, parameters and inputs.
#[test]
fn strange_links_leave_a_living_page() {
    visit(live_files(), STILL, |browser, file, page| {
        let mut wrong = Vec::new();
        let own = page.evaluate("tests.state()");
        for link in page.texts("tests.strangeLinks()") {
            let strange = Page::open(browser, &format!("{}#{link}", file.address), STILL);
            wrong.extend(strange.complaints().into_iter().map(|text| format!("{link}: {text}")));
            let refused = strange.is("tests.of('toast').textContent !== ''");
            let kept = !refused || strange.evaluate("tests.state()") == own;
            wrong.extend(unless(kept, format!("{link}: what was refused stays in part")));
            let known = strange.is("tests.of('method').value === live.player.method");
            wrong.extend(unless(known, format!("{link}: no method")));
            // Some of these motions are as fast as they are strange.
            strange.press(" ");
            let lives = strange.becomes("live.frames > 9 && live.player.instants.length > 0");
            wrong.extend(unless(lives, format!("{link}: does not play")));
        }
        wrong
    });
}

/// Where the start itself is refused, the page says why, and takes another one.
#[test]
fn a_page_without_a_start_waits_for_one() {
    visit(live_files().filter(|file| file.name == "double_pendulum"), STILL, |browser, file, _| {
        let path = file.address.strip_prefix("file://").unwrap();
        let refused = path.replace(".html", "-refused.html");
        // The first coordinate of every start.
        let html = std::fs::read_to_string(path).unwrap().replace("\"q\":[", "\"q\":[NaN*");
        std::fs::write(&refused, html).unwrap();
        let page = Page::open(browser, &format!("file://{refused}"), STILL);
        let mut wrong = Vec::new();
        page.draws();
        for (told, what) in [
            ("tests.of('status').textContent.includes('NaN')", "the status says nothing"),
            ("tests.of('drift').textContent === 'drift unknown'", "the drift is not unknown"),
            ("tests.of('drift').classList.contains('bad')", "the drift is not red"),
        ] {
            wrong.extend(unless(page.is(told), what));
        }
        page.press(" ");
        page.evaluate("tests.choose('method', 'rk4')");
        page.evaluate("tests.of('q0').focus()");
        page.press("ArrowRight");
        wrong.extend(unless(page.is("live.player.refused === null"), "takes no other start"));
        page.evaluate("tests.of('picture').focus()");
        page.press(" ");
        wrong.extend(unless(page.becomes("live.player.head > 5"), "does not play"));
        wrong.extend(page.complaints());
        wrong
    });
}

/// A method that is refused is not shown as the chosen one.
#[test]
fn refused_methods_are_not_shown() {
    visit(live_files().take(1), STILL, |_, _, page| {
        let shown = "[tests.of('method').value, tests.of('kind').textContent, tests.of('accuracy').value]";
        let before = page.texts(shown);
        page.evaluate("live.player.change = () => 'refused'");
        page.evaluate("tests.choose('method', 'rk4')");
        let after = page.texts(shown);
        unless(before == after, format!("{before:?} becomes {after:?}")).into_iter().collect()
    });
}

/// Stopping the pictures of an index is nothing to go back from.
#[test]
fn stopped_pictures_leave_the_history() {
    let indexes = files().iter().filter(|file| !file.live);
    visit(indexes, Opening { still: false, ..STILL }, |_, _, page| {
        let before = page.number("history.length");
        for _ in 0..2 {
            page.evaluate("tests.of('still').click()");
            page.evaluate("tests.frames(20)");
        }
        let after = page.number("history.length");
        unless(before == after, format!("{before} entries become {after}")).into_iter().collect()
    });
}

/// WCAG 2.2, 1.4.3, in both schemes, with everything to be seen that can be.
#[test]
fn texts_have_contrast() {
    for dark in [false, true] {
        visit(files(), Opening { dark, ..STILL }, |_, _, page| {
            page.evaluate("tests.showAll()");
            page.draws();
            let mut wrong = page.texts("[...tests.faint(), ...tests.faintOnCanvas()]");
            page.evaluate("tests.lightUp()");
            page.draws();
            wrong.extend(page.texts("tests.faint()").into_iter().map(|text| format!("lit up {text}")));
            wrong.into_iter().map(|text| format!("{}: {text}", if dark { "dark" } else { "light" })).collect()
        });
    }
}

/// Ten seconds at the tolerance 1e-8: energies change by the work of forces alone, but for errors of steps
/// that add up; constraints hold.
#[test]
fn energy_and_constraints_hold() {
    const TOLERANCE: f64 = 1e-8;
    visit(live_files(), STILL, |_, file, page| {
        let errors = page.evaluate("tests.errors()");
        eprintln!("{}: {errors}", file.name);
        let [drift, residual, steps] =
            ["drift", "residual", "steps"].map(|name| errors[name].as_f64().unwrap_or(f64::NAN));
        let wrong = [
            unless(errors["followed"] == true, "is not followed to its end"),
            unless(drift <= TOLERANCE * steps.max(1000.0), "energy drifts"),
            unless(residual <= 1e-9, "constraints do not hold"),
        ];
        wrong.into_iter().flatten().map(|text| format!("{text}: {errors}")).collect()
    });
}

/// Copies go to the clipboard, and where it is closed into a box whose text is selected.
#[test]
fn copies_need_no_clipboard() {
    visit(live_files().take(1), STILL, |_, _, page| {
        let mut wrong = Vec::new();
        let link = "location.href.split('#')[0] + '#' + live.link()";
        for (setting, done, copied) in [
            (
                "granted",
                "tests.of('toast').textContent.startsWith('Link copied')",
                "navigator.clipboard.readText()",
            ),
            ("denied", "tests.of('by-hand').open", "String(getSelection())"),
        ] {
            for name in ["clipboard-write", "clipboard-read"] {
                let permission = json!({ "name": name, "allowWithoutSanitization": true });
                page.call("Browser.setPermission", json!({ "permission": permission, "setting": setting }));
            }
            page.evaluate("tests.of('share').click()");
            wrong.extend(unless(page.becomes(done), format!("{setting}: no {done}")));
            let copied = page.evaluate(copied);
            wrong.extend(unless(copied == page.evaluate(link), format!("{setting}: copied {copied}")));
        }
        wrong
    });
}

/// No process is left behind, also where a test fails.
#[test]
fn browsers_end_with_their_tests() {
    let group = OnceLock::new();
    let failed = catch_unwind(AssertUnwindSafe(|| {
        let browser = Chromium::start()?;
        group.set(browser.group()).unwrap();
        Some(browser.tab().evaluate("undefined.member"))
    }));
    let Some(group) = group.get() else { return };
    assert!(failed.is_err());
    assert!(!kill("-0", group), "processes of the group {group} are left");
}
