//! `/docs/problems`: the page that the types of problems lead to, with a section for each kind.

use bagtrack_api::ProblemKind as Kind;

const HEAD: &str = r#"<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Problems · bagtrack</title>
<style>
:root { color-scheme: light dark; }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 46rem; margin: 2rem auto; padding: 0 1rem; }
section { border-top: 1px solid #8886; padding: .2rem 0 .6rem; }
section:target { outline: 2px solid; outline-offset: .5rem; }
code { font-size: .9em; }
nav ul { columns: 20rem; padding-left: 1rem; }
</style>
</head>
<body>
<h1>Problems</h1>
<p>Every error is a problem document (<a href="https://www.rfc-editor.org/rfc/rfc9457">RFC 9457</a>). Its
<code>type</code> leads here, its <code>detail</code> says what happened this time, and <code>request_id</code> finds it
in the log. Bad input changes no session. All calls are at <a href="./">/docs</a>.</p>
"#;

pub fn page() -> String {
    let mut page = HEAD.to_owned();
    page += "<nav><ul>\n";
    for kind in Kind::ALL {
        let (slug, status) = (kind.slug(), kind.status());
        page += &format!("<li><a href=\"#{slug}\">{status} {slug}</a></li>\n");
    }
    page += "</ul></nav>\n";
    for kind in Kind::ALL {
        let (slug, status) = (kind.slug(), kind.status());
        let [title, cause, cure] = [kind.title(), kind.cause(), kind.cure()].map(html);
        page += &format!(
            "<section id=\"{slug}\"><h2>{title}</h2>\n\
             <p><code>{slug}</code>, status {status}</p>\n\
             <p>{cause}</p>\n\
             <p><b>What to do:</b> {cure}</p></section>\n"
        );
    }
    page += "</body>\n</html>\n";
    page
}

/// A text of the catalogue as HTML: what stands in backticks is code.
fn html(text: &str) -> String {
    let escaped = text
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;");
    let parts = escaped.split('`').enumerate();
    let parts = parts.map(|(index, part)| match index % 2 {
        0 => part.to_owned(),
        _ => format!("<code>{part}</code>"),
    });
    parts.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_escaped_and_backticks_are_code() {
        assert_eq!(html("a < `b & c`."), "a &lt; <code>b &amp; c</code>.");
    }

    #[test]
    fn every_text_of_the_catalogue_closes_its_backticks_and_ends_with_a_full_stop() {
        for kind in Kind::ALL {
            for text in [kind.cause(), kind.cure()] {
                assert_eq!(text.matches('`').count() % 2, 0, "{text}");
                assert!(text.ends_with('.'), "{text}");
            }
        }
    }
}
