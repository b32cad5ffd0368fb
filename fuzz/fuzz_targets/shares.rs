//! The bytes that decide whose share a request has: the addresses that proxies forward, and the API keys.
#![no_main]

use axum::http::{HeaderMap, HeaderValue};
use bagtrack::http::{ApiKeys, Client, Secret};
use bagtrack_net::client_address;
use libfuzzer_sys::fuzz_target;
use std::net::IpAddr;

fuzz_target!(|data: &[u8]| {
    let peer: IpAddr = [10, 0, 0, 1].into();
    let trusted = ["10.0.0.0/8".parse().expect("a network")];
    let mut headers = HeaderMap::new();
    let mut parts = data.split(|byte| *byte == b'\n');
    for name in ["forwarded", "x-forwarded-for"] {
        for line in parts.by_ref().take(2) {
            if let Ok(value) = HeaderValue::from_bytes(line) {
                headers.append(name, value);
            }
        }
    }
    // An untrusted peer is the client, whatever it writes.
    let other: IpAddr = [192, 0, 2, 1].into();
    assert_eq!(client_address(other, &headers, &trusted), other);
    let address = client_address(peer, &headers, &trusted);
    assert_eq!(Client::at(address), Client::at(address.to_canonical()));
    // What a client writes in front of its own address changes nothing.
    headers.remove("forwarded");
    headers.append("x-forwarded-for", HeaderValue::from_static("198.51.100.9"));
    let own: IpAddr = [198, 51, 100, 9].into();
    assert_eq!(client_address(peer, &headers, &trusted), own);
    if let Ok(text) = std::str::from_utf8(data) {
        if let Ok(keys) = ApiKeys::load(&[Secret::from(text)], None) {
            // White space around an entry is no part of it.
            let key = text.trim().split_once(':').expect("it has a name").1;
            assert!(keys.owner(key.as_bytes()).is_some());
            assert!(keys.owner(&key.as_bytes()[1..]).is_none());
        }
    }
});
