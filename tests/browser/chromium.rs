//! A browser without a window, spoken to over a pair of pipes in the DevTools protocol.

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Names it goes by.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];
/// How long an answer may take before the browser is given up.
const PATIENCE: Duration = Duration::from_secs(120);

/// A running browser.
pub struct Browser {
    child: Child,
    to: ChildStdin,
    from: Receiver<Value>,
    number: u64,
    events: Vec<Value>,
    _profile: tempfile::TempDir,
}

/// A page in it.
pub struct Tab<'a> {
    browser: &'a mut Browser,
    session: String,
}

impl Browser {
    /// Starts one; `None`, with a word on stderr, where none is installed.
    pub fn start() -> Option<Self> {
        let is_there = |name: &&&str| {
            let found =
                Command::new(name).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
            found.is_ok_and(|status| status.success())
        };
        let Some(name) = NAMES.iter().find(is_there) else {
            eprintln!("no Chromium is installed: pages are not opened");
            return None;
        };
        let profile = tempfile::tempdir().expect("a folder");
        // The browser reads from descriptor 3 and writes to 4.
        let mut child = Command::new("sh")
            .args(["-c", "exec \"$0\" \"$@\" 3<&0 4>&1 </dev/null >/dev/null 2>&1", name])
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--hide-scrollbars",
                "--remote-debugging-pipe",
            ])
            .args([
                "--no-first-run",
                "--disable-extensions",
                "--disable-background-networking",
                "about:blank",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("a shell");
        let to = child.stdin.take().expect("a pipe");
        let mut pipe = BufReader::new(child.stdout.take().expect("a pipe"));
        let (told, from) = channel();
        std::thread::spawn(move || {
            let mut message = Vec::new();
            while pipe.read_until(0, &mut message).is_ok_and(|count| count > 0) {
                message.pop();
                let value = serde_json::from_slice(&message).expect("JSON");
                message.clear();
                if told.send(value).is_err() {
                    break;
                }
            }
        });
        Some(Self { child, to, from, number: 0, events: Vec::new(), _profile: profile })
    }

    /// A blank page of so many pixels.
    pub fn tab(&mut self, [width, height]: [u32; 2]) -> Tab<'_> {
        let target =
            self.call(None, "Target.createTarget", json!({"url": "about:blank"}))["targetId"].clone();
        let session = self.call(None, "Target.attachToTarget", json!({"targetId": target, "flatten": true}))
            ["sessionId"]
            .clone();
        let mut tab = Tab { session: session.as_str().expect("a session").to_owned(), browser: self };
        for domain in ["Page.enable", "Runtime.enable", "Log.enable", "Network.enable"] {
            tab.call(domain, json!({}));
        }
        tab.call("Performance.enable", json!({"timeDomain": "threadTicks"}));
        tab.call(
            "Emulation.setDeviceMetricsOverride",
            json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}),
        );
        tab
    }

    fn call(&mut self, session: Option<&str>, method: &str, parameters: Value) -> Value {
        self.number += 1;
        let mut message = json!({"id": self.number, "method": method, "params": parameters});
        if let Some(session) = session {
            message["sessionId"] = json!(session);
        }
        self.to
            .write_all(message.to_string().as_bytes())
            .and_then(|()| self.to.write_all(&[0]))
            .expect("a browser");
        loop {
            let answer = self.next(PATIENCE).unwrap_or_else(|| panic!("no answer to {method}"));
            if answer["id"] == json!(self.number) {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].clone();
            }
            self.events.push(answer);
        }
    }

    fn next(&mut self, patience: Duration) -> Option<Value> {
        match self.from.recv_timeout(patience) {
            Ok(message) => Some(message),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => panic!("the browser is gone"),
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.to.write_all(b"{\"id\":0,\"method\":\"Browser.close\"}\0");
        let begin = Instant::now();
        while begin.elapsed() < Duration::from_secs(5) {
            if matches!(self.child.try_wait(), Ok(Some(_))) {
                return;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let _ = self.child.kill();
    }
}

impl Tab<'_> {
    fn call(&mut self, method: &str, parameters: Value) -> Value {
        let session = self.session.clone();
        self.browser.call(Some(&session), method, parameters)
    }

    /// Opens a file and waits until all of its page is there; returns when what is in view was, in ms after it
    /// began.
    pub fn open(&mut self, file: &Path, hash: &str) -> f64 {
        let address = format!("file://{}{hash}", file.canonicalize().expect("a file").display());
        self.call("Page.navigate", json!({"url": address}));
        let begin = Instant::now();
        // One question that the page answers when it is there: many would hold it up.
        const READY: &str = "location.protocol !== 'file:' || !document.documentElement ? '' : new Promise((done) => { \
             const { dataset } = document.documentElement; \
             const look = () => { \
               const trouble = document.getElementById('trouble'); \
               if (dataset.complete) done(dataset.ready); \
               else if (trouble && !trouble.hidden) done('trouble: ' + trouble.textContent); \
               else setTimeout(look, 20); \
             }; look(); })";
        loop {
            let told = self.eval(READY);
            let told = told.as_str().expect("words").to_owned();
            assert!(!told.starts_with("trouble"), "{}: {told}", file.display());
            if let Ok(ready) = told.parse() {
                return ready;
            }
            assert!(begin.elapsed() < PATIENCE, "{} does not get ready", file.display());
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Seconds the processor has worked for the page's main thread, however busy the machine is.
    pub fn worked(&mut self) -> f64 {
        let told = self.call("Performance.getMetrics", json!({}));
        let metrics = told["metrics"].as_array().expect("metrics");
        let tasks = metrics.iter().find(|metric| metric["name"] == "TaskDuration").expect("tasks");
        tasks["value"].as_f64().expect("a number")
    }

    /// The value of an expression; promises are waited for.
    pub fn eval(&mut self, expression: &str) -> Value {
        let parameters = json!({"expression": expression, "awaitPromise": true, "returnByValue": true});
        let answer = self.call("Runtime.evaluate", parameters);
        assert!(answer.get("exceptionDetails").is_none(), "{expression}: {answer}");
        answer["result"]["value"].clone()
    }

    /// A number.
    pub fn number(&mut self, expression: &str) -> f64 {
        let value = self.eval(expression);
        value.as_f64().unwrap_or_else(|| panic!("{expression} is {value}"))
    }

    /// Presses a key and lets it go.
    pub fn key(&mut self, key: &str, shift: bool) {
        for kind in ["keyDown", "keyUp"] {
            let parameters = json!({"type": kind, "key": key, "modifiers": if shift { 8 } else { 0 }});
            self.call("Input.dispatchKeyEvent", parameters);
        }
        self.settle();
    }

    /// Moves the mouse, with `pressed` clicks there.
    pub fn mouse(&mut self, [x, y]: [f64; 2], pressed: bool) {
        let kinds: &[&str] =
            if pressed { &["mouseMoved", "mousePressed", "mouseReleased"] } else { &["mouseMoved"] };
        for kind in kinds {
            let button = if *kind == "mouseMoved" { "none" } else { "left" };
            self.call(
                "Input.dispatchMouseEvent",
                json!({"type": kind, "x": x, "y": y, "button": button, "clickCount": 1}),
            );
        }
        self.settle();
    }

    /// Drags the mouse from one place to another.
    pub fn drag(&mut self, from: [f64; 2], to: [f64; 2]) {
        for (kind, [x, y], held) in [
            ("mouseMoved", from, 0),
            ("mousePressed", from, 1),
            ("mouseMoved", to, 1),
            ("mouseReleased", to, 0),
        ] {
            let button = if held == 1 || kind == "mouseReleased" { "left" } else { "none" };
            self.call(
                "Input.dispatchMouseEvent",
                json!({"type": kind, "x": x, "y": y, "button": button, "buttons": held, "clickCount": 1}),
            );
            self.settle();
        }
    }

    /// Waits until two frames have been drawn.
    pub fn settle(&mut self) {
        self.eval("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))");
    }

    /// What the console complains of, and every address asked for but that of the page itself.
    pub fn complaints(&mut self) -> Vec<String> {
        self.settle();
        let mut found = Vec::new();
        for event in std::mem::take(&mut self.browser.events) {
            let parameters = &event["params"];
            let is_error = match event["method"].as_str().unwrap_or_default() {
                "Runtime.exceptionThrown" => true,
                "Runtime.consoleAPICalled" => {
                    ["error", "warning", "assert"].iter().any(|kind| parameters["type"] == *kind)
                }
                "Log.entryAdded" => parameters["entry"]["level"] == "error",
                "Network.requestWillBeSent" => {
                    let address = parameters["request"]["url"].as_str().unwrap_or_default();
                    !(address.starts_with("file:") && parameters["type"] == "Document")
                }
                _ => false,
            };
            if is_error {
                found.push(parameters.to_string().chars().take(600).collect());
            }
        }
        found
    }

    /// What is seen, as a PNG file.
    pub fn screenshot(&mut self, file: &Path) {
        use base64::Engine as _;
        let picture = self.call("Page.captureScreenshot", json!({"format": "png"}))["data"].clone();
        let bytes = base64::engine::general_purpose::STANDARD
            .decode(picture.as_str().expect("text"))
            .expect("base64");
        std::fs::write(file, bytes).expect("written");
    }
}
