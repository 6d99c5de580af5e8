//! A page in a tab: how it is opened, what its reader does, and what went wrong in it.

use serde_json::{Value, json};

use super::driver::{Chromium, Tab};

/// Width and height of a window.
pub(crate) type Size = [u32; 2];
pub(crate) const PHONE: Size = [390, 844];
pub(crate) const DESK: Size = [1200, 900];

/// What tests ask of a page, as functions of `tests`.
const TESTS: &str = include_str!("tests.js");

/// How a page is opened.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Opening {
    pub(crate) size: Size,
    /// The reader wants less motion: the page does not start by itself.
    pub(crate) still: bool,
    pub(crate) dark: bool,
}

/// Still and light, on a desk: what most tests want.
pub(crate) const STILL: Opening = Opening { size: DESK, still: true, dark: false };

/// An open page.
pub(crate) struct Page<'b> {
    tab: Tab<'b>,
    /// The file, without what stands behind `#`.
    file: String,
    live: bool,
}

impl<'b> Page<'b> {
    /// Opens an address. Functions of `tests` are in scope of all that is evaluated.
    pub(crate) fn open(browser: &'b Chromium, address: &str, opening: Opening) -> Self {
        let tab = browser.tab();
        let choose = |name: &str, value: &str| json!({ "name": name, "value": value });
        let features = [
            choose("prefers-reduced-motion", if opening.still { "reduce" } else { "no-preference" }),
            choose("prefers-color-scheme", if opening.dark { "dark" } else { "light" }),
        ];
        tab.call("Emulation.setEmulatedMedia", json!({ "features": features }));
        tab.call("Page.addScriptToEvaluateOnNewDocument", json!({ "source": TESTS }));
        let file = address.split('#').next().unwrap_or_default().to_owned();
        let mut page = Self { tab, file, live: false };
        page.resize(opening.size);
        page.tab.open(address);
        // Scripts are unpacked after the page is loaded.
        page.live = page.is("Boolean(document.getElementById('packed'))");
        assert!(!page.live || page.becomes("window.live"), "{address} does not run: {:?}", page.complaints());
        page
    }

    /// Changes the window, which is that of a phone where it is narrow.
    pub(crate) fn resize(&self, [width, height]: Size) {
        let phone = width < 500;
        let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": phone });
        self.call("Emulation.setDeviceMetricsOverride", metrics);
        self.call("Emulation.setTouchEmulationEnabled", json!({ "enabled": phone }));
    }

    pub(crate) fn evaluate(&self, expression: &str) -> Value {
        self.tab.evaluate(expression)
    }

    pub(crate) fn call(&self, method: &str, parameters: Value) -> Value {
        self.tab.call(method, parameters)
    }

    /// Whether an expression is true.
    pub(crate) fn is(&self, expression: &str) -> bool {
        self.evaluate(expression) == true
    }

    /// A list of texts.
    pub(crate) fn texts(&self, expression: &str) -> Vec<String> {
        let value = self.evaluate(expression);
        let list = value.as_array().unwrap_or_else(|| panic!("{expression}: {value}"));
        list.iter().map(|text| text.as_str().map_or_else(|| text.to_string(), str::to_owned)).collect()
    }

    pub(crate) fn number(&self, expression: &str) -> f64 {
        let value = self.evaluate(expression);
        value.as_f64().unwrap_or_else(|| panic!("{expression}: {value}"))
    }

    /// Waits until an expression is true; false where it does not become so.
    pub(crate) fn becomes(&self, expression: &str) -> bool {
        self.is(&format!("tests.becomes(() => {expression})"))
    }

    /// Waits until what was changed is drawn.
    pub(crate) fn draws(&self) {
        self.evaluate("tests.frames(2)");
    }

    /// Presses a key as a keyboard does.
    pub(crate) fn press(&self, key: &str) {
        self.press_with(key, false);
    }

    /// Presses a key, with shift or without.
    pub(crate) fn press_with(&self, key: &str, shift: bool) {
        let (code, number) = match key {
            " " => ("Space".to_owned(), 32),
            "," => ("Comma".to_owned(), 188),
            "." => ("Period".to_owned(), 190),
            "Tab" => (key.to_owned(), 9),
            "ArrowLeft" => (key.to_owned(), 37),
            "ArrowUp" => (key.to_owned(), 38),
            "ArrowRight" => (key.to_owned(), 39),
            "ArrowDown" => (key.to_owned(), 40),
            letter => {
                let letter = letter.to_uppercase();
                (format!("Key{letter}"), u32::from(letter.as_bytes()[0]))
            }
        };
        let mut event = json!({ "key": key, "code": code, "windowsVirtualKeyCode": number });
        event["modifiers"] = json!(if shift { 8 } else { 0 });
        if key.chars().count() == 1 {
            event["text"] = key.into();
        }
        for kind in ["keyDown", "keyUp"] {
            event["type"] = kind.into();
            self.call("Input.dispatchKeyEvent", event.clone());
        }
    }

    /// A pointer that is `pressed`, `moved` or `released` at a place of the window.
    pub(crate) fn pointer(&self, what: &str, [x, y]: [f64; 2], finger: bool) {
        if finger {
            let points = if what == "released" { json!([]) } else { json!([{ "x": x, "y": y }]) };
            let kind = match what {
                "pressed" => "touchStart",
                "moved" => "touchMove",
                _ => "touchEnd",
            };
            self.call("Input.dispatchTouchEvent", json!({ "type": kind, "touchPoints": points }));
        } else {
            let kind = match what {
                "pressed" => "mousePressed",
                "moved" => "mouseMoved",
                _ => "mouseReleased",
            };
            let event = json!({
                "type": kind, "x": x, "y": y, "button": "left", "buttons": u32::from(what != "released"),
                "clickCount": u32::from(what != "moved"),
            });
            self.call("Input.dispatchMouseEvent", event);
        }
    }

    /// Exceptions, errors and warnings of the console, and requests for anything but the page itself. An
    /// index may ask for the pages beside it.
    pub(crate) fn complaints(&self) -> Vec<String> {
        self.tab.events().iter().filter_map(|event| self.complaint(event)).collect()
    }

    fn complaint(&self, event: &Value) -> Option<String> {
        let (method, parameters) = (event["method"].as_str()?, &event["params"]);
        let is_one_of = |value: &Value, kinds: &[&str]| kinds.iter().any(|kind| value == kind);
        let bad = match method {
            "Runtime.exceptionThrown" => true,
            "Runtime.consoleAPICalled" => is_one_of(&parameters["type"], &["error", "warning", "assert"]),
            "Log.entryAdded" => is_one_of(&parameters["entry"]["level"], &["error", "warning"]),
            "Network.requestWillBeSent" => {
                let url = parameters["request"]["url"].as_str()?;
                return (!self.may_request(url)).then(|| format!("requests {url}"));
            }
            _ => false,
        };
        bad.then(|| format!("{method} {parameters}"))
    }

    fn may_request(&self, url: &str) -> bool {
        let folder = |address: &str| address.rsplit_once('/').map(|(folder, _)| folder.to_owned());
        let beside = !self.live && folder(url) == folder(&self.file);
        url.starts_with("data:") || url == self.file || beside
    }
}
