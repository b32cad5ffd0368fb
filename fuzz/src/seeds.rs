//! Writes the seeds, the first inputs of the fuzz targets, to `FOLDER/TARGET/`: `seeds FOLDER`.

use axum::http::Method;
use bagtrack_fuzz::{content_of, jpeg, png, webp, Answer, Service, Shelf, Stored, BOX, SETTINGS};
use base64::engine::general_purpose::STANDARD;
use base64::Engine;
// The counters of the branches count there, unread.
use libfuzzer_sys as _;
use std::fs;
use std::io;
use std::path::PathBuf;

/// The folder that the inputs are written to.
struct Seeds(PathBuf);

impl Seeds {
    fn write(&self, target: &str, name: &str, bytes: &[u8]) -> io::Result<()> {
        let folder = self.0.join(target);
        fs::create_dir_all(&folder)?;
        fs::write(folder.join(format!("seed-{name}")), bytes)
    }

    fn pictures(&self) -> io::Result<()> {
        for (name, picture) in [("png", png(0)), ("jpeg", jpeg(0)), ("webp", webp(0))] {
            self.write("decode", name, &picture)?;
            self.write("multipart", name, &form(&picture))?;
            let text = STANDARD.encode(&picture);
            let json = format!(
                r#"{{"frame": "{text}", "box": [16, 12, 16, 12], "preset": "paper", "parameters": {{"particles": 20}}}}"#
            );
            self.write("json", name, json.as_bytes())?;
            let json = format!(r#"{{"frames": ["{text}", "{text}"]}}"#);
            self.write("json", &format!("{name}-several"), json.as_bytes())?;
        }
        Ok(())
    }

    fn shares(&self) -> io::Result<()> {
        let text = b"for=192.0.2.7;by=10.0.0.3, for=\"[2001:db8::1]:80\"\n\n192.0.2.7, 10.0.0.3\n2001:db8::1";
        self.write("shares", "forwarded", text)?;
        self.write("shares", "key", b" ann:0123456789abcdef0123456789abcdef ")
    }

    fn videos(&self) -> io::Result<()> {
        let motion = [jpeg(0), jpeg(1)].concat();
        let files: [(&str, &[u8]); 5] = [
            ("mp4", b"\0\0\0\x18ftypisom\0\0\x02\0isomiso2\0\0\0\x08free"),
            ("avif", b"\0\0\0\x18ftypavif\0\0\0\0mif1avif\0\0\0\x08free"),
            (
                "webm",
                b"\x1A\x45\xDF\xA3\x93\x42\x82\x84webm\x42\x87\x81\x02",
            ),
            ("gif", b"GIF89a\x02\0\x02\0\x80\0\0"),
            ("mjpeg", &motion),
        ];
        for (name, file) in files {
            self.write("video", name, &[&[0], file].concat())?;
        }
        let shown = |picture: &[u8]| {
            let length = picture.len();
            let line = format!("0, 40000, 40000, 40000, {length}, 0x034c072f, S=1, 8\n");
            [line.as_bytes(), picture].concat()
        };
        let head = b"#software: Lavf59.27.100\n#tb 0: 1/1000000\n".to_vec();
        let written = [head, shown(&jpeg(0)), shown(&jpeg(1))].concat();
        let noise = "[cache @ 0x55] Inner protocol failed to seekback end : -38\n    Last message repeated 1 times\n";
        let unlisted = "[matroska @ 0x55] Codec (vorbis) not on whitelist 'h264,vp8'\n";
        let damage = "[h264 @ 0x55] error while decoding MB 3 4, bytestream -5\r\n";
        for (name, said) in [
            ("whole", noise),
            ("unlisted", unlisted),
            ("damaged", damage),
        ] {
            let length = u16::try_from(said.len()).expect("it is short");
            let input = [&[1], &length.to_le_bytes()[..], said.as_bytes(), &written].concat();
            self.write("video", name, &input)?;
        }
        Ok(())
    }

    /// Some frames of a session with each preset, and of one with a list of boxes.
    fn sessions(&self) -> io::Result<()> {
        let (service, shelf) = Service::with_store(Shelf::new());
        let (one, list) = (
            format!("box={BOX}"),
            "boxes=%5B%5B16,12,16,12%5D,%5B8,4,12,10%5D%5D",
        );
        for (name, boxes, preset) in [
            ("robust", &one[..], ""),
            ("paper", &one, "&preset=paper"),
            ("list", list, "&preset=paper"),
        ] {
            let session = format!("/sessions/{}", uuid::Uuid::from_u128(1));
            let open = format!("{session}?{boxes}&{SETTINGS}{preset}");
            sent(service.send((Method::PUT, &open), "image/png", &png(0)))?;
            for t in 1..4 {
                let get = format!("{session}/snapshot");
                let snapshot = sent(service.send((Method::GET, &get), "text/plain", b""))?;
                if t == 3 {
                    let (version, content) = content_of(&snapshot.body)?;
                    let input = [&[version], &content[..]].concat();
                    self.write("snapshot", name, &input)?;
                }
                let post = format!("{session}/frames");
                sent(service.send((Method::POST, &post), "image/png", &png(t)))?;
            }
            let records = shelf.take_written();
            for (number, input) in Stored::inputs(&records[2])?.iter().enumerate() {
                self.write("records", &format!("{name}-{number}"), input)?;
            }
            service.delete(&session);
        }
        Ok(())
    }
}

/// A form with a picture, after the byte that says how it arrives.
fn form(picture: &[u8]) -> Vec<u8> {
    let mut form = b"\x41".to_vec();
    for (field, value) in [
        ("box", BOX),
        ("preset", "paper"),
        ("parameters", "{\"particles\": 20}"),
    ] {
        let part =
            format!("--B\r\nContent-Disposition: form-data; name=\"{field}\"\r\n\r\n{value}\r\n");
        form.extend_from_slice(part.as_bytes());
    }
    let head = b"--B\r\nContent-Disposition: form-data; name=\"frame\"; filename=\"a\"\r\n\r\n";
    [&form, &head[..], picture, b"\r\n--B--\r\n"].concat()
}

/// The body of an answer, which must be success.
fn sent(answer: Answer) -> io::Result<Answer> {
    match answer.status.is_success() {
        true => Ok(answer),
        false => Err(io::Error::other(
            String::from_utf8_lossy(&answer.body).into_owned(),
        )),
    }
}

fn main() -> io::Result<()> {
    let folder = std::env::args_os().nth(1);
    let folder = folder.ok_or_else(|| io::Error::other("which folder?"))?;
    let seeds = Seeds(folder.into());
    seeds.pictures()?;
    seeds.shares()?;
    seeds.videos()?;
    seeds.sessions()
}
