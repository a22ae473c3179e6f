//! Keys, as the browser wants them.

use serde_json::{Value, json};

pub(crate) struct Key {
    key: String,
    code: String,
    /// What it types, if it does.
    text: Option<String>,
    number: u32,
    shift: bool,
}

impl Key {
    /// By its name, as [`super::page::Page::press`] takes it.
    pub(crate) fn named(name: &str) -> Self {
        let (name, shift) = match name.strip_prefix("Shift+") {
            Some(name) => (name, true),
            None => (name, false),
        };
        let (key, text, number) = match name {
            "Space" => (" ", Some(" "), 32),
            "Enter" => ("Enter", Some("\r"), 13),
            "Tab" => (name, None, 9),
            "Escape" => (name, None, 27),
            "Backspace" => (name, None, 8),
            "Delete" => (name, None, 46),
            "PageUp" => (name, None, 33),
            "PageDown" => (name, None, 34),
            "End" => (name, None, 35),
            "Home" => (name, None, 36),
            "ArrowLeft" => (name, None, 37),
            "ArrowUp" => (name, None, 38),
            "ArrowRight" => (name, None, 39),
            "ArrowDown" => (name, None, 40),
            _ => {
                let mut letters = name.chars();
                let (letter, rest) = (letters.next(), letters.next());
                let letter =
                    letter.filter(|_| rest.is_none()).unwrap_or_else(|| panic!("there is no key {name}"));
                (name, Some(name), letter.to_ascii_uppercase().into())
            }
        };
        let code = match (name, text) {
            ("Space", _) => "Space".to_owned(),
            (_, Some(letter)) if letter.as_bytes()[0].is_ascii_alphabetic() => {
                format!("Key{}", letter.to_ascii_uppercase())
            }
            (_, Some(letter)) if letter.as_bytes()[0].is_ascii_digit() => format!("Digit{letter}"),
            _ => name.to_owned(),
        };
        Self { key: key.into(), code, text: text.map(Into::into), number, shift }
    }

    /// Down and up.
    pub(crate) fn events(&self) -> [Value; 2] {
        let event = |kind: &str, text: &Option<String>| {
            let mut event = json!({
                "type": kind, "key": self.key, "code": self.code, "windowsVirtualKeyCode": self.number,
                "modifiers": if self.shift { 8 } else { 0 },
            });
            if let Some(text) = text {
                event["text"] = text.as_str().into();
            }
            event
        };
        let down = if self.text.is_some() { "keyDown" } else { "rawKeyDown" };
        [event(down, &self.text), event("keyUp", &None)]
    }
}
