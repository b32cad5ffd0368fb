//! What a multipart form costs the service that comes in pieces of four bytes.
//!
//! The body is chunked: each piece is a chunk, so the service gets as many pieces however they travel. The service is a
//! process of its own, and its processor time is told.

use bagtrack_testing::command::program;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::process::{Child, Command, Stdio};

use crate::clock;

const PIECE: usize = 4;
/// Parts of a form with long heads: as many files as one request may have.
const PARTS: usize = 64;
/// A head that is just short enough.
const HEAD: usize = 15 << 10;

struct Service {
    process: Child,
    address: SocketAddr,
}

impl Service {
    fn start() -> Self {
        let mut command = Command::new(program("bagtrack"));
        command.args(["serve", "--listen", "127.0.0.1:0"]);
        command.args(["--body-timeout", "10m", "--min-body-rate", "1"]);
        let mut process = command
            .env("NO_COLOR", "1")
            .stderr(Stdio::piped())
            .spawn()
            .expect("cargo builds the program");
        let log = process.stderr.take().expect("it is piped");
        let mut lines = BufReader::new(log).lines().map_while(Result::ok);
        let address = lines.find_map(|line| {
            let (_, address) = line.split_once("listening on http://")?;
            address.split(' ').next()?.parse().ok()
        });
        let address = address.expect("it starts");
        std::thread::spawn(move || lines.for_each(drop));
        Self { process, address }
    }

    /// Sends this form in pieces; gives the seconds of processor time that it took, and the status of the answer.
    fn cost(&self, form: &[u8]) -> (f64, String) {
        let head = "POST /sessions?box=1,1,9,9 HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
            Content-Type: multipart/form-data; boundary=b\r\nTransfer-Encoding: chunked\r\n\r\n";
        let mut request = head.as_bytes().to_vec();
        for piece in form.chunks(PIECE) {
            request.extend_from_slice(format!("{:x}\r\n", piece.len()).as_bytes());
            request.extend_from_slice(piece);
            request.extend_from_slice(b"\r\n");
        }
        request.extend_from_slice(b"0\r\n\r\n");
        let before = clock::of_process(self.process.id());
        let mut connection = TcpStream::connect(self.address).expect("it listens");
        // It answers early where it refuses the rest.
        let _ = connection.write_all(&request);
        let mut answer = Vec::new();
        let _ = connection.read_to_end(&mut answer);
        let status = String::from_utf8_lossy(&answer);
        let status = status.split(' ').nth(1).unwrap_or("closed").to_owned();
        (clock::of_process(self.process.id()) - before, status)
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A file, with a line in the middle that begins as the boundary does.
fn file(bytes: usize) -> Vec<u8> {
    let begin = "--b\r\nContent-Disposition: form-data; name=\"frame\"; filename=\"a\"\r\n\r\n";
    let content: Vec<u8> = b"\r\n--a".iter().copied().cycle().take(bytes).collect();
    [begin.as_bytes(), &content, b"\r\n--b--\r\n"].concat()
}

/// So many bytes before the first part.
fn preamble(bytes: usize) -> Vec<u8> {
    [vec![b'x'; bytes], file(100)].concat()
}

/// Parts whose heads take so many bytes together.
fn heads(bytes: usize) -> Vec<u8> {
    let parts = (bytes / HEAD).min(PARTS);
    let filling = "x".repeat(HEAD - 100);
    let part = format!(
        "--b\r\nContent-Disposition: form-data; name=\"frame\"; filename=\"a\"\r\nX: {filling}\r\n\r\nno picture\r\n"
    );
    [part.repeat(parts).as_bytes(), b"--b--\r\n"].concat()
}

/// Prints a line for each kind of form and size: bytes, milliseconds of the service's processor time, microseconds for
/// each piece, and the status of the answer.
pub fn print() {
    type Form = fn(usize) -> Vec<u8>;
    let kinds: [(&str, Form); 3] = [("file", file), ("heads", heads), ("preamble", preamble)];
    let service = Service::start();
    println!("form\tbytes\tms\tus_per_piece\tstatus");
    for (name, form) in kinds {
        for size in [
            128 << 10,
            256 << 10,
            512 << 10,
            960 << 10,
            4 << 20,
            16 << 20,
        ] {
            let form = form(size);
            let (seconds, status) = service.cost(&form);
            let piece = seconds * 1e6 / form.len().div_ceil(PIECE) as f64;
            println!(
                "{name}\t{}\t{:.0}\t{piece:.2}\t{status}",
                form.len(),
                seconds * 1e3
            );
        }
    }
}
