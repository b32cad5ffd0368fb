//! `bagtrack health`: asks a running service whether it is healthy, for health checks in containers without another
//! client.

use super::address::loopback;
#[cfg(feature = "tls")]
use super::any_certificate;
use bagtrack::http::{parse_duration, parse_listen};
use http::Uri;
use std::error::Error;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
#[cfg(feature = "tls")]
use std::path::PathBuf;
use std::time::Duration;

/// Longest answer that is read; `/healthz` has some hundred bytes.
const MAX_ANSWER: u64 = 64 << 10;

/// Flags of `health`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Where the service is, like `http://127.0.0.1:8080` [default: this host, at the port of BAGTRACK_LISTEN]. With
    /// `https` the certificate is not checked.
    #[arg(long, env = "BAGTRACK_URL")]
    url: Option<Uri>,
    /// The address that the service listens on.
    #[arg(long, env = "BAGTRACK_LISTEN", default_value = "127.0.0.1:8080", value_parser = parse_listen)]
    listen: SocketAddr,
    /// The certificate of a service that speaks HTTPS. The file is not read.
    #[cfg(feature = "tls")]
    #[arg(long, env = "BAGTRACK_TLS_CERT", value_name = "FILE")]
    tls_cert: Option<PathBuf>,
    /// How long to wait for it.
    #[arg(long, default_value = "3s", value_parser = parse_duration)]
    timeout: Duration,
}

/// How the service is asked.
#[derive(Debug, Clone, Copy)]
enum Scheme {
    Http,
    #[cfg(feature = "tls")]
    Https,
}

impl Args {
    fn scheme(&self) -> Scheme {
        #[cfg(feature = "tls")]
        if self.tls_cert.is_some() {
            return Scheme::Https;
        }
        Scheme::Http
    }
}

pub fn run(args: Args) -> Result<(), Box<dyn Error>> {
    let (scheme, address, host) = match &args.url {
        None => {
            let address = reachable(args.listen);
            (args.scheme(), address, address.to_string())
        }
        Some(url) => resolve(url)?,
    };
    let status = ask(scheme, address, &host, args.timeout)
        .map_err(|error| format!("no answer from {host}: {error}"))?;
    match status.as_str() {
        "200" => Ok(()),
        other => Err(format!("{host} answered with status {other}").into()),
    }
}

/// An address to connect to: loopback for a service that listens on all addresses.
fn reachable(mut listen: SocketAddr) -> SocketAddr {
    if listen.ip().is_unspecified() {
        listen.set_ip(loopback(listen.ip()));
    }
    listen
}

fn resolve(url: &Uri) -> Result<(Scheme, SocketAddr, String), Box<dyn Error>> {
    let (scheme, port) = match url.scheme_str() {
        Some("http") => (Scheme::Http, 80),
        #[cfg(feature = "tls")]
        Some("https") => (Scheme::Https, 443),
        _ => return Err("--url (BAGTRACK_URL) must begin with http:// or https://".into()),
    };
    let host = url.host().ok_or("--url (BAGTRACK_URL) has no host")?;
    let port = url.port_u16().unwrap_or(port);
    let name = host.trim_start_matches('[').trim_end_matches(']');
    let address = (name, port).to_socket_addrs()?.next();
    let address = address.ok_or_else(|| format!("{host} has no address"))?;
    Ok((scheme, address, format!("{host}:{port}")))
}

/// The status code of `GET /healthz`.
fn ask(
    scheme: Scheme,
    address: SocketAddr,
    host: &str,
    timeout: Duration,
) -> Result<String, Box<dyn Error>> {
    let stream = TcpStream::connect_timeout(&address, timeout)?;
    stream.set_read_timeout(Some(timeout))?;
    stream.set_write_timeout(Some(timeout))?;
    match scheme {
        Scheme::Http => status_over(stream, host),
        #[cfg(feature = "tls")]
        Scheme::Https => status_over(any_certificate::connect(stream, address)?, host),
    }
}

fn status_over(mut stream: impl Read + Write, host: &str) -> Result<String, Box<dyn Error>> {
    write!(
        stream,
        "GET /healthz HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"
    )?;
    let mut answer = Vec::new();
    // A service may end a TLS connection without `close_notify`, which is an error after the answer.
    let read = stream.take(MAX_ANSWER).read_to_end(&mut answer);
    if answer.is_empty() {
        read?;
    }
    let answer = String::from_utf8_lossy(&answer);
    let mut words = answer.split_ascii_whitespace();
    match (words.next(), words.next()) {
        (Some("HTTP/1.1"), Some(status)) => Ok(status.to_owned()),
        _ => Err("that is no HTTP answer".into()),
    }
}
