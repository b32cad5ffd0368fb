//! Pages of other origins, other hosts, and the security headers for browsers.

use crate::application::{BOX, TestApplication, expect, expect_detail, expect_problem};
use crate::pictures;
use reqwest::{Method, StatusCode};

const ELSEWHERE: &str = "https://elsewhere.example";

#[tokio::test]
async fn a_page_of_another_origin_opens_no_session() {
    let app = TestApplication::start().await;
    let own = format!("http://{}", app.address);
    let open = async |headers: &[(&'static str, &str)]| {
        let mut request = app.request(Method::POST, "/sessions", &[("box", BOX)]);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        request.body(pictures::png(0)).send().await.unwrap()
    };
    for origin in [ELSEWHERE, "null", "http://127.0.0.1:1", ""] {
        let refused = open(&[("origin", origin)]).await;
        expect_problem(refused, "origin-not-allowed").await;
        let refused = open(&[("origin", origin), ("sec-fetch-site", "cross-site")]).await;
        expect_problem(refused, "origin-not-allowed").await;
    }
    // Accepted: the service's own page, also behind a proxy that names another host; and programs.
    expect(open(&[("origin", &own)]).await, StatusCode::CREATED).await;
    let proxied = [("origin", ELSEWHERE), ("sec-fetch-site", "same-origin")];
    expect(open(&proxied).await, StatusCode::CREATED).await;
    expect(open(&[]).await, StatusCode::CREATED).await;
}

/// A proxy that leaves the port out of `Host` makes pages of other ports look like the service's own.
#[tokio::test]
async fn a_page_that_the_browser_calls_another_site_is_refused_whatever_the_host_says() {
    let app = TestApplication::start().await;
    let open = async |app: &TestApplication, site: &str| {
        let request = app.request(Method::POST, "/sessions", &[("box", BOX)]);
        let request = request.header("host", "localhost");
        let request = request.header("origin", "http://localhost");
        let request = request.header("sec-fetch-site", site);
        request.body(pictures::png(0)).send().await.unwrap()
    };
    for site in ["same-site", "cross-site", ""] {
        expect_problem(open(&app, site).await, "origin-not-allowed").await;
    }
    expect(open(&app, "same-origin").await, StatusCode::CREATED).await;
    // The settings may allow it all the same.
    let allowing = TestApplication::start_with(|config| {
        config.cors_origins = vec!["http://localhost".to_owned()];
    });
    let opened = open(&allowing.await, "same-site").await;
    expect(opened, StatusCode::CREATED).await;
}

#[tokio::test]
async fn a_page_of_an_allowed_origin_may_call_and_read_the_headers() {
    let origins = vec![ELSEWHERE.to_owned()];
    let app = TestApplication::start_with(|config| config.cors_origins = origins).await;
    let asked = app.request(Method::OPTIONS, "/sessions", &[]);
    let asked = asked
        .header("origin", ELSEWHERE)
        .header("access-control-request-method", "POST")
        .header(
            "access-control-request-headers",
            "authorization,idempotency-key,traceparent",
        );
    let headers = asked.send().await.unwrap().headers().clone();
    assert_eq!(headers["access-control-allow-origin"], ELSEWHERE);
    assert_eq!(headers["access-control-max-age"], "7200");
    let allowed = headers["access-control-allow-headers"].to_str().unwrap();
    for name in [
        "authorization",
        "idempotency-key",
        "traceparent",
        "content-type",
    ] {
        assert!(allowed.contains(name), "{allowed}");
    }
    let request = app.request(Method::POST, "/sessions", &[("box", BOX)]);
    let request = request.header("origin", ELSEWHERE).body(pictures::png(0));
    let created = request.send().await.unwrap();
    assert_eq!(created.headers()["access-control-allow-origin"], ELSEWHERE);
    let exposed = created.headers()["access-control-expose-headers"]
        .to_str()
        .unwrap();
    for name in [
        "location",
        "x-request-id",
        "traceparent",
        "draining",
        "replayed",
        "retry-after",
        "ratelimit",
        "ratelimit-policy",
    ] {
        assert!(exposed.contains(name), "{exposed}");
    }
    expect(created, StatusCode::CREATED).await;
    for method in [Method::OPTIONS, Method::POST] {
        let other = app.request(method.clone(), "/sessions", &[("box", BOX)]);
        let other = other
            .header("origin", "https://another.example")
            .header("access-control-request-method", "POST")
            .body(pictures::png(0));
        let other = other.send().await.unwrap();
        assert!(!other.headers().contains_key("access-control-allow-origin"));
        if method == Method::POST {
            expect_problem(other, "origin-not-allowed").await;
        }
    }
}

#[tokio::test]
async fn only_allowed_hosts_are_served_but_for_probes() {
    let hosts = vec!["track.example".to_owned()];
    let app = TestApplication::start_with(|config| config.access.allowed_hosts = hosts).await;
    let get = async |path: &str, host: &str| {
        let request = app.request(Method::GET, path, &[]).header("host", host);
        request.send().await.unwrap()
    };
    for host in ["track.example", "TRACK.example:8443"] {
        assert_eq!(get("/", host).await.status(), StatusCode::OK, "{host}");
    }
    for host in ["rebound.example", "127.0.0.1", "track.example.evil.example"] {
        for path in ["/", "/sessions/67e55044-10b1-426f-9247-bb680e5fe0c8"] {
            expect_problem(get(path, host).await, "host-not-allowed").await;
        }
        for path in ["/healthz", "/readyz", "/metrics"] {
            assert_eq!(get(path, host).await.status(), StatusCode::OK, "{path}");
        }
    }
}

#[tokio::test]
async fn a_service_for_this_machine_alone_is_not_served_under_a_rebound_name() {
    let app = TestApplication::start().await;
    let port = app.address.port();
    let open = async |host: &str| {
        let request = app.request(Method::POST, "/sessions", &[("box", BOX)]);
        let request = request.header("host", host).body(pictures::png(0));
        request.send().await.unwrap()
    };
    for host in ["localhost", "127.0.0.1", "[::1]"] {
        let host = format!("{host}:{port}");
        assert_eq!(open(&host).await.status(), StatusCode::CREATED, "{host}");
    }
    let rebound = format!("rebound.example:{port}");
    let refused = open(&rebound).await;
    expect_detail(refused, "host-not-allowed", &["--allowed-hosts"]).await;
    // With API keys, DNS rebinding gives a page no access; a trusted proxy may name any host.
    let keys = TestApplication::start_with(|config| {
        config.access.api_keys = vec![bagtrack::http::Secret::from("me:0123456789abcdef")];
    });
    let proxied = TestApplication::start_with(|config| {
        config.limits.trusted_proxies = vec!["127.0.0.1/32".parse().unwrap()];
    });
    for app in [keys.await, proxied.await] {
        let page = app
            .request(Method::GET, "/", &[])
            .header("host", "track.example");
        assert_eq!(page.send().await.unwrap().status(), StatusCode::OK);
    }
}

#[tokio::test]
async fn every_answer_tells_browsers_what_it_may_do() {
    let app = TestApplication::start().await;
    for path in [
        "/",
        "/page/main.js",
        "/docs/",
        "/openapi.json",
        "/healthz",
        "/nowhere",
        "/panic",
    ] {
        let response = app.get(path).await;
        let header = |name: &str| response.headers()[name].to_str().unwrap();
        assert_eq!(header("x-content-type-options"), "nosniff", "{path}");
        assert_eq!(header("x-frame-options"), "DENY", "{path}");
        assert_eq!(header("referrer-policy"), "no-referrer", "{path}");
        let policy = header("content-security-policy");
        assert!(policy.starts_with("default-src 'none'"), "{path}: {policy}");
        assert!(
            policy.contains("frame-ancestors 'none'"),
            "{path}: {policy}"
        );
        assert!(
            !policy.contains("script-src 'self' 'unsafe"),
            "{path}: {policy}"
        );
    }
}

#[tokio::test]
async fn the_pages_keep_to_their_policies() {
    let app = TestApplication::start().await;
    for path in ["/", "/docs/"] {
        let page = app.get(path).await.text().await.unwrap();
        assert!(page.contains("<script"), "{path}");
        // A policy without 'unsafe-inline' blocks scripts in the page and in attributes.
        for script in page.split("<script").skip(1) {
            let (tag, rest) = script.split_once('>').unwrap();
            assert!(tag.contains("src="), "{path}: {tag}");
            assert!(rest.trim_start().starts_with("</script>"), "{path}");
        }
        assert!(
            !page.contains(" onclick=") && !page.contains("javascript:"),
            "{path}"
        );
        for source in page
            .split("src=\"")
            .skip(1)
            .chain(page.split("href=\"").skip(1))
        {
            let (source, _) = source.split_once('"').unwrap();
            assert!(!source.starts_with("http"), "{path}: {source}");
        }
    }
    for (path, media_type) in [
        ("/page/main.js", "text/javascript"),
        ("/page/page.css", "text/css"),
    ] {
        let response = app.get(path).await;
        assert_eq!(response.status(), StatusCode::OK);
        let got = response.headers()["content-type"].to_str().unwrap();
        assert!(got.starts_with(media_type), "{got}");
    }
}
