//! What the log contains, and what it must not contain.

use crate::application::BOX;
use crate::pictures;
use crate::program::Program;
use image::ImageFormat;
use reqwest::{Client, Method};
use rustix::process::Signal;
use serde_json::Value;

#[tokio::test]
async fn a_line_has_the_ids_once_no_full_session_id_and_probes_have_none() {
    for format in ["json", "text"] {
        let flags = ["--log-format", format, "--shutdown-delay", "0s"];
        let (service, client) = (Program::start(&flags, &[]), Client::new());
        let url = service.url(&format!("/sessions?box={BOX}"));
        let created = client.post(url).body(pictures::png(0));
        let created: Value = created.send().await.unwrap().json().await.unwrap();
        let id = created["id"].as_str().unwrap();
        let trace = "4bf92f3577b34da6a3ce929d0e0e4736";
        let request = client.post(service.url(&format!("/sessions/{id}/frames")));
        let request = request
            .header("x-request-id", "the-request")
            .header("traceparent", format!("00-{trace}-00f067aa0ba902b7-01"));
        request.body("no image").send().await.unwrap();
        // The picture's header has height 0, which must not panic.
        let mut jpeg = pictures::encode(pictures::scene(1), ImageFormat::Jpeg);
        let start = jpeg.windows(2).position(|two| two == [0xFF, 0xC0]).unwrap();
        jpeg[start + 5..start + 7].fill(0);
        let flat = client.post(service.url(&format!("/sessions/{id}/frames")));
        let flat = flat.body(jpeg).send().await.unwrap();
        assert_eq!(flat.status(), 422);
        // Whether the service takes such spellings of an id or not, it must not log the id in full.
        let encoded = format!("/sessions/%{:02x}{}", id.as_bytes()[0], &id[1..]);
        for path in [encoded, format!("/sessions/{id};x=1")] {
            client.get(service.url(&path)).send().await.unwrap();
        }
        for path in ["/healthz", "/readyz", "/metrics"] {
            client.get(service.url(path)).send().await.unwrap();
        }
        // A long method must not make a long line, which would fill disks.
        let odd = Method::from_bytes(&[b'A'; 6000]).unwrap();
        let odd = client.request(odd, service.url("/sessions"));
        assert_eq!(odd.send().await.unwrap().status(), 405);
        let deleted = client.delete(service.url(&format!("/sessions/{id}")));
        deleted.send().await.unwrap();
        service.signal(Signal::TERM);
        let (_, log) = service.ends();
        let text = log.join("\n");
        assert!(!text.contains(&id[9..]), "{text}");
        assert!(
            !text.contains("ERROR") && !text.contains("panicked"),
            "{text}"
        );
        assert!(text.contains(&id[..8]), "{text}");
        assert!(log.iter().all(|line| line.len() < 1000), "{text}");
        for probe in ["/healthz", "/readyz", "/metrics"] {
            assert!(!text.contains(probe), "{text}");
        }
        let mut lines = log.iter().filter(|line| line.contains("the-request"));
        let line = lines.next().expect("the line of the request");
        assert_eq!(lines.next(), None, "its refusal is in the same line");
        for word in ["the-request", trace, "/frames", "unsupported-image"] {
            assert_eq!(line.matches(word).count(), 1, "{line}");
        }
    }
}

#[tokio::test]
async fn a_line_tells_the_client_and_the_name_of_its_key_but_not_the_key() {
    const KEY: &str = "0123456789abcdef";
    let flags = [
        "--log-format",
        "json",
        "--shutdown-delay",
        "0s",
        "--api-keys",
        "ann:0123456789abcdef",
        "--trusted-proxies",
        "127.0.0.0/8",
    ];
    let (service, client) = (Program::start(&flags, &[]), Client::new());
    let get = async |id: &str, key: &str| {
        let request = client.get(service.url("/sessions/none"));
        let request = request.header("x-forwarded-for", "203.0.113.9");
        request
            .header("x-request-id", id)
            .bearer_auth(key)
            .send()
            .await
            .unwrap();
    };
    get("with-key", KEY).await;
    get("without", "another-key-of-somebody").await;
    let probe = client.get(service.url("/metrics")).send().await.unwrap();
    assert_eq!(probe.status(), 401);
    service.signal(Signal::TERM);
    let (_, log) = service.ends();
    let of = |id: &str| {
        let mut lines = log.iter().filter(move |line| line.contains(id));
        let line = lines.find(|line| line.contains("answered"));
        line.unwrap_or_else(|| panic!("{log:?}"))
    };
    for id in ["with-key", "without"] {
        assert_eq!(of(id).matches("203.0.113.9").count(), 1, "{}", of(id));
    }
    assert!(
        of("with-key").contains(r#""key":"ann""#),
        "{}",
        of("with-key")
    );
    assert!(!of("without").contains(r#""key""#), "{}", of("without"));
    // A refused probe is logged.
    let probe = log.iter().find(|line| line.contains("/metrics"));
    assert!(probe.unwrap().contains("unauthorized"), "{probe:?}");
    let all = log.join("\n");
    assert!(!all.contains(KEY) && !all.contains("another-key"), "{all}");
}
