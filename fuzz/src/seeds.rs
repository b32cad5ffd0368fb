//! Writes the first inputs of the targets to `corpus/`, beside the current folder's own ones.

use axum::http::Method;
use bagtrack_fuzz::{content_of, jpeg, png, webp, Service, BOX};
use base64::engine::general_purpose::STANDARD;
use base64::Engine;
use std::fs;
use std::io;

fn main() -> io::Result<()> {
    let pictures = [("png", png(0)), ("jpeg", jpeg(0)), ("webp", webp(0))];
    for (name, picture) in &pictures {
        write("decode", name, picture)?;
        let mut form = b"\x40".to_vec();
        for (field, value) in [
            ("box", BOX),
            ("preset", "paper"),
            ("parameters", "{\"particles\": 20}"),
        ] {
            let head = format!(
                "--B\r\nContent-Disposition: form-data; name=\"{field}\"\r\n\r\n{value}\r\n"
            );
            form.extend_from_slice(head.as_bytes());
        }
        form.extend_from_slice(
            b"--B\r\nContent-Disposition: form-data; name=\"frame\"; filename=\"a\"\r\n\r\n",
        );
        form.extend_from_slice(picture);
        form.extend_from_slice(b"\r\n--B--\r\n");
        form[0] = 0x41;
        write("multipart", name, &form)?;
        let json = format!(
            r#"{{"frame": "{}", "box": [16, 12, 16, 12], "preset": "paper", "parameters": {{"particles": 20}}}}"#,
            STANDARD.encode(picture)
        );
        write("json", name, json.as_bytes())?;
        let json = format!(r#"{{"frames": ["{0}", "{0}"]}}"#, STANDARD.encode(picture));
        write("json", &format!("{name}-several"), json.as_bytes())?;
    }
    let service = Service::new();
    for preset in ["paper", "robust"] {
        // Small, so that a change meets something of each part.
        let params =
            "%7B%22particles%22:20,%22patch_width%22:8,%22patch_height%22:8,%22bag_size%22:2%7D";
        let path = format!("/sessions?box={BOX}&seed=7&preset={preset}&parameters={params}");
        let created = service.send((Method::POST, &path), "image/png", &png(0));
        let session = created
            .session()
            .ok_or_else(|| io::Error::other(String::from_utf8_lossy(&created.body).into_owned()))?;
        for t in 1..8 {
            let get = format!("{session}/snapshot");
            let snapshot = service.send((Method::GET, &get), "text/plain", b"").body;
            if t % 3 == 1 {
                write(
                    "snapshot",
                    &format!("{preset}-{t}"),
                    &content_of(&snapshot)?,
                )?;
            }
            service.send(
                (Method::POST, &format!("{session}/frames")),
                "image/png",
                &png(t),
            );
        }
    }
    Ok(())
}

fn write(target: &str, name: &str, bytes: &[u8]) -> io::Result<()> {
    let folder = format!("corpus/{target}");
    fs::create_dir_all(&folder)?;
    fs::write(format!("{folder}/seed-{name}"), bytes)
}
