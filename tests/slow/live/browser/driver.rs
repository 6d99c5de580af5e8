//! Chromium over its debugging pipe: a process, its tabs, and the messages of both.
//!
//! Chromium reads commands from descriptor 3 and writes answers and events to descriptor 4, each a JSON text
//! that ends with a zero byte (`--remote-debugging-pipe`). A shell puts the pipes of the process there.

use std::cell::{Cell, RefCell};
use std::ffi::OsString;
use std::io::{BufRead as _, BufReader, Write as _, stderr};
use std::os::unix::fs::MetadataExt as _;
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};
use std::{env, fs, process, thread};

use serde_json::{Value, json};

/// Longest wait for an answer: a browser that hangs fails its test.
const PATIENCE: Duration = Duration::from_secs(120);
/// Longest wait for a browser that was told to end, before it is killed.
const END: Duration = Duration::from_secs(5);
const NAMES: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];
/// Nothing but the page: no first run, no updates, no pauses of what is not in front.
const FLAGS: &str = "--headless --remote-debugging-pipe --disable-gpu --no-first-run \
    --disable-background-networking --disable-component-update --disable-sync --disable-quic \
    --disable-breakpad --disable-dev-shm-usage --disable-background-timer-throttling \
    --disable-backgrounding-occluded-windows --disable-renderer-backgrounding";

/// A running browser, which ends with this value.
pub(crate) struct Chromium {
    process: Child,
    commands: RefCell<ChildStdin>,
    messages: Receiver<Value>,
    /// Events that no tab has read yet.
    events: RefCell<Vec<Value>>,
    count: Cell<u64>,
    folder: PathBuf,
}

/// The program that `DYNAMICS_CHROMIUM` names, or the first that is installed.
fn program() -> Option<OsString> {
    let installed = |name: &str| {
        let path = env::var_os("PATH").unwrap_or_default();
        env::split_paths(&path).map(|folder| folder.join(name)).find(|file| file.is_file())
    };
    env::var_os("DYNAMICS_CHROMIUM").or_else(|| NAMES.into_iter().find_map(installed).map(Into::into))
}

impl Chromium {
    /// Starts a browser. Without one the test is skipped, which is said even where output is captured; with
    /// `DYNAMICS_BROWSER=1` it fails.
    pub(crate) fn start() -> Option<Self> {
        static STARTED: AtomicU32 = AtomicU32::new(0);
        let Some(program) = program() else {
            assert!(env::var_os("DYNAMICS_BROWSER").is_none_or(|x| x != "1"), "no Chromium was found");
            let test = thread::current().name().unwrap_or_default().to_owned();
            let _ = writeln!(stderr(), "{test}: skipped, because no Chromium was found");
            return None;
        };
        let name = format!("chromium-{}-{}", process::id(), STARTED.fetch_add(1, Ordering::Relaxed));
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        // Its sandbox refuses to work for root.
        let root = fs::metadata("/proc/self").is_ok_and(|own| own.uid() == 0);
        let mut shell = Command::new("sh");
        shell.args(["-c", "exec \"$0\" \"$@\" 3<&0 4>&1 0</dev/null 1>&2"]).arg(program);
        shell.args(FLAGS.split_whitespace()).args(root.then_some("--no-sandbox"));
        shell.arg(format!("--user-data-dir={}", folder.display()));
        // A group of its own: what it starts can be ended with it.
        shell.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).process_group(0);
        let mut process = shell.spawn().expect("a shell");
        let (commands, output) = (process.stdin.take().unwrap(), process.stdout.take().unwrap());
        let (send, messages) = channel();
        thread::spawn(move || {
            let texts = BufReader::new(output).split(0).map_while(Result::ok);
            texts
                .map_while(|text| serde_json::from_slice(&text).ok())
                .all(|message| send.send(message).is_ok());
        });
        let (commands, events, count) = (RefCell::new(commands), RefCell::default(), Cell::new(0));
        Some(Self { process, commands, messages, events, count, folder })
    }

    fn send(&self, session: Option<&str>, method: &str, parameters: &Value) -> std::io::Result<u64> {
        let id = self.count.get() + 1;
        self.count.set(id);
        let mut message = json!({ "id": id, "method": method, "params": parameters });
        session.inspect(|&session| message["sessionId"] = session.into());
        self.commands.borrow_mut().write_all(format!("{message}\0").as_bytes()).map(|()| id)
    }

    /// The result of a command; events that come before it are kept.
    fn call(&self, session: Option<&str>, method: &str, parameters: &Value) -> Value {
        let id = self.send(session, method, parameters).unwrap_or_else(|e| panic!("{method}: {e}"));
        loop {
            let mut message = self.next(method);
            if message["id"] == id {
                assert!(message.get("error").is_none(), "{method} {parameters}: {}", message["error"]);
                return message["result"].take();
            }
            self.events.borrow_mut().push(message);
        }
    }

    fn next(&self, wanted: &str) -> Value {
        self.messages.recv_timeout(PATIENCE).unwrap_or_else(|e| panic!("{wanted}: no answer, {e}"))
    }

    /// All its processes, as `kill` names them.
    pub(crate) fn group(&self) -> String {
        format!("-{}", self.process.id())
    }

    /// A new empty tab.
    pub(crate) fn tab(&self) -> Tab<'_> {
        let mut target = self.call(None, "Target.createTarget", &json!({ "url": "about:blank" }));
        let target = target["targetId"].take();
        let attach = json!({ "targetId": target, "flatten": true });
        let session = self.call(None, "Target.attachToTarget", &attach);
        let session = session["sessionId"].as_str().unwrap().to_owned();
        let tab = Tab { browser: self, target, session };
        tab.call("Emulation.setFocusEmulationEnabled", json!({ "enabled": true }));
        for domain in ["Page", "Runtime", "Log", "Network"] {
            tab.call(&format!("{domain}.enable"), json!({}));
        }
        tab
    }
}

/// Sends a signal to a group of processes; false where there is none left.
pub(crate) fn kill(signal: &str, group: &str) -> bool {
    let status = Command::new("kill").args([signal, "--", group]).stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}

/// Ends the browser with all its processes, also where a test fails; nothing here may panic.
impl Drop for Chromium {
    fn drop(&mut self) {
        let begin = Instant::now();
        let _ = self.send(None, "Browser.close", &json!({}));
        while let Some(left) = END.checked_sub(begin.elapsed()) {
            // The pipe ends with the last process that holds it.
            if self.messages.recv_timeout(left) == Err(RecvTimeoutError::Disconnected) {
                break;
            }
        }
        let group = self.group();
        kill("-KILL", &group);
        let _ = self.process.wait();
        // Its other processes wait for the system to take notice of their end.
        while kill("-0", &group) && begin.elapsed() < 2 * END {
            thread::sleep(Duration::from_millis(10));
        }
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// A tab, which is closed with this value.
pub(crate) struct Tab<'b> {
    browser: &'b Chromium,
    target: Value,
    session: String,
}

impl Tab<'_> {
    pub(crate) fn call(&self, method: &str, parameters: Value) -> Value {
        self.browser.call(Some(&self.session), method, &parameters)
    }

    /// Opens an address in a tab that is new and waits for its load event.
    pub(crate) fn open(&self, address: &str) {
        self.call("Page.navigate", json!({ "url": address }));
        while !self.events().iter().any(|event| event["method"] == "Page.loadEventFired") {
            let message = self.browser.next(address);
            self.browser.events.borrow_mut().push(message);
        }
    }

    /// What happened in this tab so far.
    pub(crate) fn events(&self) -> Vec<Value> {
        let all = self.browser.events.borrow();
        all.iter().filter(|event| event["sessionId"] == *self.session).cloned().collect()
    }

    /// The value of an expression, or of the promise that it is; its exception as a panic.
    pub(crate) fn evaluate(&self, expression: &str) -> Value {
        let options = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let mut answer = self.call("Runtime.evaluate", options);
        let exception = &answer["exceptionDetails"];
        assert!(exception.is_null(), "{expression}\n{exception:#}");
        answer["result"]["value"].take()
    }
}

impl Drop for Tab<'_> {
    fn drop(&mut self) {
        let _ = self.browser.send(None, "Target.closeTarget", &json!({ "targetId": self.target }));
        self.browser.events.borrow_mut().retain(|event| event["sessionId"] != *self.session);
    }
}
