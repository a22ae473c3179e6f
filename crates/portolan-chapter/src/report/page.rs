//! The page around the sections, and the small pieces of HTML that they are made of.

use std::fmt::Write;

use super::Section;

/// Colors keep a contrast of at least 4.5 : 1 for text in both schemes.
const STYLE: &str = "
:root{--paper:#fff;--ink:#1f2933;--muted:#55606b;--line:#d5dae0;--soft:#f4f6f8;--best:#0f6b4b;--accent:#6d3590;--warn:#8a4300}
@media (prefers-color-scheme:dark){:root{--paper:#14181d;--ink:#e6eaee;--muted:#a3aeb9;--line:#37404a;--soft:#1e242b;--best:#63d3a6;--accent:#c79be6;--warn:#f2b27a}}
*{box-sizing:border-box}
body{margin:0 auto;padding:2rem 1.2rem 4rem;max-width:72rem;background:var(--paper);color:var(--ink);font:17px/1.55 system-ui,sans-serif}
h1{font-size:2rem;line-height:1.2;margin:.2em 0 .5em}h2{font-size:1.4rem;margin:2.6em 0 .5em;border-top:1px solid var(--line);padding-top:1em}
p,ul{max-width:48rem}.lead{font-size:1.1em}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:.9rem;font-variant-numeric:tabular-nums;width:100%}
th,td{padding:.42em .7em;text-align:right;border-bottom:1px solid var(--line);vertical-align:top}
th:first-child,td:first-child,td.text,th.text{text-align:left}thead th{border-bottom:2px solid var(--ink);white-space:nowrap}
td b{color:var(--best)}small,figcaption,.command{color:var(--muted)}td small{display:block}
.grid{display:grid;grid-template-columns:repeat(auto-fit,minmax(20rem,1fr));gap:1.3rem;margin:1.2rem 0}
figure{margin:0}figure.wide{max-width:48rem;margin:1.2rem 0}figure.full{margin:1.2rem 0}nav{columns:2;max-width:48rem}nav a{color:var(--accent)}.scrolls{display:none}img{display:block;width:100%;height:auto;background:#fff;border:1px solid var(--line);border-radius:4px}
figcaption{font-size:.88rem;margin-top:.4em}figcaption b{color:var(--ink)}
.command{font-size:.88rem}code{font:.92em ui-monospace,monospace;background:var(--soft);padding:.12em .4em;border-radius:3px;color:var(--ink)}
.legend span{display:inline-block;margin-right:1.2em;white-space:nowrap;font-size:.9rem}.legend i{display:inline-block;width:1.1em;height:.75em;margin-right:.4em;border:1px solid var(--line);vertical-align:baseline}
@media (max-width:60rem){.scrolls{display:block}nav{columns:1}}
/* Pictures are drawn on white: in the dark light becomes dark, and colors keep their hue. */
@media (prefers-color-scheme:dark){img,.legend i{filter:invert(1) hue-rotate(180deg)}}
.warn{color:var(--warn)}sub{line-height:0}
";

/// The whole file.
pub(super) fn page(introduction: &str, sections: &[Section]) -> String {
    let contents: String = sections
        .iter()
        .map(|s| format!("<li><a href=\"#{}\">{}</a></li>", anchor(s.title), escaped(s.title)))
        .collect();
    let mut html = format!(
        "<!doctype html>\n<html lang=en>\n<head>\n<meta charset=utf-8>\n\
         <meta name=viewport content=\"width=device-width,initial-scale=1\">\n\
         <meta name=color-scheme content=\"light dark\">\n<title>One log, every map</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n<main>\n<h1>One log, every map: what each answer costs, and how true it is</h1>\n\
         {introduction}\n<nav aria-label=Contents><ul>{contents}</ul></nav>\n"
    );
    for Section { title, body, command } in sections {
        // What is said about the command stands behind it, three blanks away.
        let (command, note) = command.split_once("   ").unwrap_or((command, ""));
        // Writing to a string cannot fail.
        let _ = write!(
            html,
            "<section>\n<h2 id=\"{}\">{}</h2>\n{body}\n<p class=command>The command: <code>{}</code> {}</p>\n</section>\n",
            anchor(title),
            escaped(title),
            escaped(command),
            escaped(note)
        );
    }
    html.push_str("</main>\n</body>\n</html>\n");
    html
}

/// The name of a section in addresses.
fn anchor(title: &str) -> String {
    let letters = title.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' });
    letters.collect()
}

/// Text that can stand in HTML.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A table of cells that are HTML already; columns named in `text` are set left.
pub(super) fn table(header: &[&str], rows: &[Vec<String>], text: &[usize]) -> String {
    let class = |i: usize| if text.contains(&i) { " class=text" } else { "" };
    let mut html = String::from(
        "<p class=\"scrolls command\">The table scrolls sideways.</p><div class=scroll tabindex=0 role=region \
         aria-label=\"A table that scrolls sideways\"><table><thead><tr>",
    );
    header.iter().enumerate().for_each(|(i, h)| {
        let _ = write!(html, "<th scope=col{}>{h}</th>", class(i));
    });
    html.push_str("</tr></thead><tbody>\n");
    for row in rows {
        html.push_str("<tr>");
        row.iter().enumerate().for_each(|(i, cell)| {
            let _ = write!(html, "<td{}>{cell}</td>", class(i));
        });
        html.push_str("</tr>\n");
    }
    html + "</tbody></table></div>"
}

/// A picture inside the page.
pub(super) fn figure(png: &[u8], class: &str, alt: &str, caption: &str) -> String {
    let class = if class.is_empty() { String::new() } else { format!(" class={class}") };
    format!(
        "<figure{class}><img alt=\"{}\" src=\"data:image/png;base64,{}\"><figcaption>{caption}</figcaption></figure>\n",
        escaped(alt),
        base64(png)
    )
}

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let bits = (0..3).fold(0u32, |bits, i| bits << 8 | u32::from(three.get(i).copied().unwrap_or(0)));
        for i in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= three.len() { digit as char } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_as_in_the_standard() {
        for (plain, coded) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }
}
