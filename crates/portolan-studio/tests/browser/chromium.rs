//! Headless Chromium and its DevTools protocol, over a pipe: no port, and a browser that ends when the tests end, however
//! they end. <https://chromedevtools.github.io/devtools-protocol/>

use std::collections::HashMap;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Duration;

use serde_json::{Value, json};

/// So long anything may take, on a machine that is busy with other things.
pub(crate) const SOON: Duration = Duration::from_secs(60);

/// The browser writes to and reads from descriptors 3 and 4. Its profile is removed when it has ended, which it does when
/// its end of the pipe is closed.
const START: &str = r#"
profile="$(mktemp -d)"
"$0" --user-data-dir="$profile" "$@" 3<&0 4>&1 </dev/null >/dev/null 2>&1
rm -rf "$profile"
"#;

/// WebGL is drawn in software; nothing is asked of the network, and pages that are not in front are not slowed down.
const FLAGS: [&str; 17] = [
    "--headless",
    "--remote-debugging-pipe",
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--disable-background-timer-throttling",
    "--disable-backgrounding-occluded-windows",
    "--disable-renderer-backgrounding",
    "--hide-scrollbars",
    "about:blank",
];

/// What is called for each event of a target.
type Listener = Arc<dyn Fn(&Value) + Send + Sync>;

/// A running browser.
pub(crate) struct Chromium {
    _process: Child,
    commands: Mutex<ChildStdin>,
    next: AtomicU64,
    heard: Arc<Heard>,
}

/// Who waits for what the browser says.
#[derive(Default)]
struct Heard {
    answers: Mutex<HashMap<u64, Sender<Value>>>,
    events: Mutex<HashMap<String, Listener>>,
}

/// The browser that all tests share, each in pages of its own. Without one it says so: `.ci/run` lets nothing be skipped.
pub(crate) fn chromium() -> Option<&'static Chromium> {
    static SHARED: OnceLock<Option<Chromium>> = OnceLock::new();
    let shared = SHARED.get_or_init(|| Some(Chromium::start(&path()?)));
    if shared.is_none() {
        // Past the capture of test output, or nobody would see it.
        let _ =
            writeln!(std::io::stderr(), "SKIPPED: chromium is missing; install it, or name it with CHROMIUM");
    }
    shared.as_ref()
}

/// `CHROMIUM`, or the first of its usual names that is there.
fn path() -> Option<String> {
    let named = std::env::var("CHROMIUM").ok().filter(|p| !p.is_empty());
    let usual = ["chromium", "chromium-browser", "google-chrome"].map(String::from);
    let runs = |p: &String| {
        Command::new(p)
            .arg("--version")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|s| s.success())
    };
    named.into_iter().chain(usual).find(runs)
}

impl Chromium {
    fn start(path: &str) -> Self {
        let mut process = Command::new("sh")
            .args(["-c", START, path])
            .args(FLAGS)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("a shell can be started");
        let commands = Mutex::new(process.stdin.take().expect("it was asked for"));
        let said = process.stdout.take().expect("it was asked for");
        let heard = Arc::new(Heard::default());
        let listening = heard.clone();
        std::thread::spawn(move || listening.listen(said));
        Self { _process: process, commands, next: AtomicU64::new(1), heard }
    }

    /// Sends a command, to a session or to the browser, and waits for its result.
    pub(crate) fn call(
        &self,
        session: Option<&str>,
        method: &str,
        parameters: Value,
    ) -> Result<Value, String> {
        let id = self.next.fetch_add(1, Ordering::Relaxed);
        let (sender, answer) = channel();
        self.heard.answers.lock().unwrap().insert(id, sender);
        let mut message = json!({ "id": id, "method": method, "params": parameters });
        if let Some(session) = session {
            message["sessionId"] = session.into();
        }
        let bytes = format!("{message}\0");
        self.commands.lock().unwrap().write_all(bytes.as_bytes()).map_err(|e| format!("{method}: {e}"))?;
        let mut answer = answer.recv_timeout(SOON).map_err(|e| format!("{method}: no answer: {e}"))?;
        match answer.get("error") {
            Some(error) => Err(format!("{method}: {error}")),
            None => Ok(answer["result"].take()),
        }
    }

    /// Has `listener` called for each event of a session, on the thread that hears them.
    pub(crate) fn listen(&self, session: &str, listener: impl Fn(&Value) + Send + Sync + 'static) {
        self.heard.events.lock().unwrap().insert(session.to_owned(), Arc::new(listener));
    }

    pub(crate) fn forget(&self, session: &str) {
        self.heard.events.lock().unwrap().remove(session);
    }
}

impl Heard {
    /// Until the browser is gone.
    fn listen(&self, said: ChildStdout) {
        let mut messages = BufReader::new(said).split(0);
        while let Some(Ok(message)) = messages.next() {
            let Ok(message) = serde_json::from_slice::<Value>(&message) else { continue };
            if let Some(id) = message["id"].as_u64() {
                let waiting = self.answers.lock().unwrap().remove(&id);
                // Whoever has given up waiting is gone.
                let _ = waiting.map(|w| w.send(message));
            } else if let Some(session) = message["sessionId"].as_str() {
                let listener = self.events.lock().unwrap().get(session).cloned();
                if let Some(listener) = listener {
                    listener(&message);
                }
            }
        }
        // Nobody waits a minute for a browser that has ended.
        self.answers.lock().unwrap().clear();
    }
}
