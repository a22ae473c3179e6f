//! A page of the studio in the browser, driven as its user would: pointer, keys, what stands on the screen.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use portolan_studio::server::Server;
use serde_json::{Value, json};

use super::chromium::{Chromium, SOON};
use super::keys::Key;

/// What the page is opened on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Screen {
    pub(crate) size: [u32; 2],
    pub(crate) dark: bool,
    /// Device pixels per CSS pixel.
    pub(crate) ratio: f64,
}

impl Screen {
    /// A laptop's.
    pub(crate) const LIGHT: Self = Self { size: [1440, 900], dark: false, ratio: 1.0 };
    pub(crate) const DARK: Self = Self { dark: true, ..Self::LIGHT };

    pub(crate) fn name(&self) -> String {
        let [w, h] = self.size;
        format!("{w}x{h}-{}", if self.dark { "dark" } else { "light" })
    }
}

/// A page, closed when it is dropped.
pub(crate) struct Page {
    chromium: &'static Chromium,
    context: String,
    session: String,
    errors: Arc<Mutex<Vec<String>>>,
}

/// Runs before the page's own scripts: `ask` of the tests goes through the page's own socket, so that both have the same
/// session; the page passes over answers to questions that are not its own.
const BEFORE: &str = r#"
{
  const Socket = WebSocket;
  let next = 4e9;
  window.WebSocket = class extends Socket {
    constructor(...args) {
      super(...args);
      window.testAsk = (view, ask) => new Promise((resolve, reject) => {
        const id = next++;
        const answered = async ({ data }) => {
          let message;
          if (typeof data === "string") {
            message = JSON.parse(data);
            if (message.id !== id) return;
          } else {
            const { decode } = await import("/engine/engine.js");
            const { id: whose, answer } = decode(data);
            if (whose !== id) return;
            const arrays = Object.fromEntries(Object.entries(answer.arrays).map(([k, v]) => [k, [...v]]));
            message = { ok: { ...answer.body, arrays } };
          }
          this.removeEventListener("message", answered);
          if (message.error !== undefined) reject(new Error(message.error));
          else resolve(message.ok);
        };
        this.addEventListener("message", answered);
        this.send(JSON.stringify({ id, view, ask }));
      });
    }
  };
}
"#;

/// The page has shown its first view, or says that it cannot: the status line says what there is, or what is wrong.
const READY: &str = r#"document.querySelector("[role=tab][aria-selected=true], .alone") && !document.getElementById("status").textContent.startsWith("Connecting")"#;

impl Page {
    /// Opens what comes after the `#` of the studio's address, and waits until it is shown.
    pub(crate) fn open(chromium: &'static Chromium, server: &Server, state: &str, screen: Screen) -> Self {
        let browser = |method: &str, parameters: Value| chromium.call(None, method, parameters).unwrap();
        let word = |value: &Value| value.as_str().unwrap().to_owned();
        // A context of its own: nothing is remembered from other tests.
        let context = word(&browser("Target.createBrowserContext", json!({}))["browserContextId"]);
        let target =
            browser("Target.createTarget", json!({ "url": "about:blank", "browserContextId": context }));
        let attached =
            browser("Target.attachToTarget", json!({ "targetId": target["targetId"], "flatten": true }));
        let session = word(&attached["sessionId"]);
        let errors = Arc::new(Mutex::new(Vec::new()));
        let collected = errors.clone();
        chromium.listen(&session, move |event| collected.lock().unwrap().extend(complaint(event)));

        let page = Self { chromium, context, session, errors };
        for domain in ["Page", "Runtime", "Log", "Network"] {
            page.call(&format!("{domain}.enable"), json!({}));
        }
        page.call("Emulation.setFocusEmulationEnabled", json!({ "enabled": true }));
        page.call("Page.addScriptToEvaluateOnNewDocument", json!({ "source": BEFORE }));
        page.show_on(screen);
        page.call("Page.navigate", json!({ "url": format!("{}#{state}", server.url()) }));
        page.wait_for(READY);
        page
    }

    /// Another screen under the same page.
    pub(crate) fn show_on(&self, screen: Screen) {
        let [width, height] = screen.size;
        self.call(
            "Emulation.setDeviceMetricsOverride",
            json!({ "width": width, "height": height, "deviceScaleFactor": screen.ratio, "mobile": false }),
        );
        let scheme = if screen.dark { "dark" } else { "light" };
        let features = json!([{ "name": "prefers-color-scheme", "value": scheme }]);
        self.call("Emulation.setEmulatedMedia", json!({ "features": features }));
        self.settle();
    }

    fn call(&self, method: &str, parameters: Value) -> Value {
        self.chromium.call(Some(&self.session), method, parameters).unwrap_or_else(|e| panic!("{e}"))
    }

    /// The value of an expression; what it promises is awaited.
    pub(crate) fn eval(&self, expression: &str) -> Value {
        let parameters = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true, "userGesture": true });
        let mut answer = self.call("Runtime.evaluate", parameters);
        if let Some(exception) = answer.get("exceptionDetails") {
            panic!("{expression}: {}", exception["exception"]["description"]);
        }
        answer["result"]["value"].take()
    }

    /// Calls a function with arguments.
    pub(crate) fn apply(&self, function: &str, arguments: &[Value]) -> Value {
        let list: Vec<_> = arguments.iter().map(Value::to_string).collect();
        self.eval(&format!("({function})({})", list.join(", ")))
    }

    /// Asks the engine of this page, through the page's own socket. Beside the answer are its `arrays`.
    pub(crate) fn ask(&self, view: &str, ask: Value) -> Value {
        self.apply("(view, ask) => testAsk(view, ask)", &[view.into(), ask])
    }

    /// Waits until an expression is true.
    pub(crate) fn wait_for(&self, condition: &str) {
        let start = Instant::now();
        while !self.truth(condition) {
            if start.elapsed() > SOON {
                panic!(
                    "never came: {condition}; status: {}; errors: {:#?}",
                    self.text("status"),
                    self.errors()
                );
            }
            std::thread::sleep(Duration::from_millis(30));
        }
    }

    fn truth(&self, condition: &str) -> bool {
        self.eval(&format!("Boolean({condition})")) == true
    }

    /// Waits until the page has drawn what it was asked to draw.
    pub(crate) fn settle(&self) {
        self.eval("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))");
    }

    /// What an element says.
    pub(crate) fn text(&self, id: &str) -> String {
        let text = self.apply("(id) => document.getElementById(id)?.textContent ?? null", &[id.into()]);
        text.as_str().unwrap_or_else(|| panic!("there is no #{id}")).to_owned()
    }

    /// Waits until an element says this among other things.
    pub(crate) fn wait_text(&self, id: &str, part: &str) {
        let (id, part) = (json!(id), json!(part));
        self.wait_for(&format!("document.getElementById({id})?.textContent.includes({part})"));
    }

    pub(crate) fn is_visible(&self, id: &str) -> bool {
        self.truth(&format!("document.getElementById({})?.checkVisibility()", json!(id)))
    }

    /// Clicks into the middle of an element.
    pub(crate) fn click(&self, id: &str) {
        let [_, _, w, h] = self.area(id);
        self.click_at(id, [0.5 * w, 0.5 * h]);
    }

    /// Clicks at a place of an element (CSS pixels from its upper left corner).
    pub(crate) fn click_at(&self, id: &str, at: [f64; 2]) {
        self.drag(id, at, at);
    }

    /// Moves the pointer there.
    pub(crate) fn point_at(&self, id: &str, at: [f64; 2]) {
        self.mouse("mouseMoved", 0, self.place(id, at));
    }

    /// Presses at one place of an element, and lets go at another.
    pub(crate) fn drag(&self, id: &str, from: [f64; 2], to: [f64; 2]) {
        let (from, to) = (self.place(id, from), self.place(id, to));
        self.mouse("mouseMoved", 0, from);
        self.mouse("mousePressed", 1, from);
        if from != to {
            for step in 1..=8 {
                let share = f64::from(step) / 8.0;
                self.mouse("mouseMoved", 1, [0, 1].map(|k| from[k] + share * (to[k] - from[k])));
            }
        }
        self.mouse("mouseReleased", 0, to);
    }

    fn mouse(&self, kind: &str, buttons: u32, [x, y]: [f64; 2]) {
        let button = if kind == "mouseMoved" && buttons == 0 { "none" } else { "left" };
        self.call(
            "Input.dispatchMouseEvent",
            json!({ "type": kind, "x": x, "y": y, "button": button, "buttons": buttons, "clickCount": 1 }),
        );
    }

    /// Left, top, width and height of an element on the screen, which is scrolled to.
    pub(crate) fn area(&self, id: &str) -> [f64; 4] {
        let area = self.apply(
            "(id) => {
                const node = document.getElementById(id);
                if (!node?.checkVisibility()) throw new Error(`there is no #${id} to be seen`);
                node.scrollIntoView({ block: 'nearest' });
                const { left, top, width, height } = node.getBoundingClientRect();
                return [left, top, width, height];
            }",
            &[id.into()],
        );
        serde_json::from_value(area).unwrap()
    }

    fn place(&self, id: &str, [x, y]: [f64; 2]) -> [f64; 2] {
        let [left, top, ..] = self.area(id);
        [left + x, top + y]
    }

    /// Moves a slider to one of its values (for sliders over a list: to the n-th), as a hand does.
    pub(crate) fn set_slider(&self, id: &str, value: f64) {
        self.set(id, value.into());
    }

    /// Chooses from a list.
    pub(crate) fn choose(&self, id: &str, value: &str) {
        self.set(id, value.into());
    }

    fn set(&self, id: &str, value: Value) {
        self.apply(
            "(id, value) => {
                const node = document.getElementById(id);
                node.focus();
                node.value = value;
                if (node.value !== String(value)) throw new Error(`#${id} does not take ${value}`);
                for (const type of ['input', 'change']) node.dispatchEvent(new Event(type, { bubbles: true }));
            }",
            &[id.into(), value],
        );
    }

    /// Moves the keyboard's focus.
    pub(crate) fn focus(&self, id: &str) {
        self.apply("(id) => document.getElementById(id).focus()", &[id.into()]);
    }

    /// Presses a key: `a`, `?`, `Space`, `Enter`, `Tab`, `ArrowLeft`, ..., with `Shift+` before it where that is held.
    pub(crate) fn press(&self, key: &str) {
        for event in Key::named(key).events() {
            self.call("Input.dispatchKeyEvent", event);
        }
    }

    /// The ids of the views, in the order of their tabs.
    pub(crate) fn views(&self) -> Vec<String> {
        let ids = self
            .eval("[...document.querySelectorAll('[role=tab]')].map((tab) => tab.id.replace('tab-', ''))");
        serde_json::from_value(ids).unwrap()
    }

    /// Opens a view by its tab, and waits until it is there.
    pub(crate) fn show(&self, view: &str) {
        self.click(&format!("tab-{view}"));
        self.wait_shown(view);
    }

    pub(crate) fn wait_shown(&self, view: &str) {
        let (tab, section) = (json!(format!("tab-{view}")), json!(format!("view-{view}")));
        self.wait_for(&format!(
            "document.getElementById({tab}).ariaSelected === 'true' && document.getElementById({section})?.checkVisibility()"
        ));
        self.rest();
    }

    /// Waits until nothing is awaited of the engine, and all of it is drawn.
    pub(crate) fn rest(&self) {
        const AT_REST: &str = "document.body.dataset.awaited === '0'";
        loop {
            self.wait_for(AT_REST);
            self.settle();
            // What came may have been a reason to ask again.
            if self.truth(AT_REST) {
                return;
            }
        }
    }

    /// Saves a picture of the page, where `PORTOLAN_SCREENSHOTS` names a folder for them.
    pub(crate) fn screenshot(&self, name: &str) {
        let Some(folder) = std::env::var_os("PORTOLAN_SCREENSHOTS").map(PathBuf::from) else { return };
        self.settle();
        let picture = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        std::fs::create_dir_all(&folder).unwrap();
        let bytes = base64(picture["data"].as_str().unwrap());
        std::fs::write(folder.join(format!("{name}.png")), bytes).unwrap();
    }

    /// What the page saves goes into this folder.
    pub(crate) fn save_into(&self, folder: &Path) {
        let settings = json!({ "behavior": "allow", "browserContextId": self.context, "downloadPath": folder.to_str().unwrap() });
        self.chromium.call(None, "Browser.setDownloadBehavior", settings).unwrap();
    }

    /// The content of a file that the page saves, when it is there.
    pub(crate) fn wait_saved(&self, path: &Path) -> Vec<u8> {
        let start = Instant::now();
        // The browser holds the name with an empty file until what it fetched takes its place.
        while std::fs::metadata(path).map_or(0, |file| file.len()) == 0 {
            assert!(start.elapsed() < SOON, "{} was never saved; {:#?}", path.display(), self.errors());
            std::thread::sleep(Duration::from_millis(30));
        }
        std::fs::read(path).unwrap()
    }

    /// Exceptions, errors of the console, requests that failed.
    pub(crate) fn errors(&self) -> Vec<String> {
        self.errors.lock().unwrap().clone()
    }

    /// Every test ends with this.
    pub(crate) fn assert_no_errors(&self) {
        // Nothing of the browser's is in the way any more once it has answered this.
        self.settle();
        let said = self.eval("document.getElementById('status').matches('.error') ? document.getElementById('status').textContent : ''");
        let errors = self.errors();
        assert!(errors.is_empty() && said == "", "status: {said}; {errors:#?}");
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        self.chromium.forget(&self.session);
        // Where the browser is gone, so is the page.
        let _ = self.chromium.call(
            None,
            "Target.disposeBrowserContext",
            json!({ "browserContextId": self.context }),
        );
    }
}

/// What is wrong, if an event says that something is.
fn complaint(event: &Value) -> Option<String> {
    let what = &event["params"];
    match event["method"].as_str()? {
        "Runtime.exceptionThrown" => {
            let details = &what["exceptionDetails"];
            Some(format!("exception: {} {}", details["text"], details["exception"]["description"]))
        }
        "Runtime.consoleAPICalled" if ["error", "assert"].contains(&what["type"].as_str()?) => {
            Some(format!("console: {}", what["args"]))
        }
        "Log.entryAdded" if what["entry"]["level"] == "error" => {
            Some(format!("log: {} {}", what["entry"]["text"], what["entry"]["url"]))
        }
        "Network.loadingFailed" if what["canceled"] != true => {
            Some(format!("request: {}", what["errorText"]))
        }
        "Network.responseReceived" if what["response"]["status"].as_u64()? >= 400 => {
            Some(format!("request: {} {}", what["response"]["status"], what["response"]["url"]))
        }
        _ => None,
    }
}

fn base64(text: &str) -> Vec<u8> {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let (mut bytes, mut held, mut bits) = (Vec::new(), 0u32, 0);
    for digit in text.bytes().filter_map(|c| DIGITS.iter().position(|d| *d == c)) {
        held = held << 6 | digit as u32;
        bits += 6;
        if bits >= 8 {
            bits -= 8;
            bytes.push((held >> bits) as u8);
            held &= (1 << bits) - 1;
        }
    }
    bytes
}
