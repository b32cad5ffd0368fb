//! Makes an accepted connection ready for HTTP: does the handshake of a service with TLS.
//!
//! The first byte of a client shows whether it speaks plain HTTP to a service with TLS. Other routes then tell the
//! client the right address.

use std::fmt::Debug;
use std::io;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;

#[cfg(feature = "tls")]
use super::certificate::Certificate;

/// The first byte of a TLS handshake: the type of its record (RFC 8446, section 5.1).
#[cfg(feature = "tls")]
const HANDSHAKE_RECORD: u8 = 22;

/// Most bytes of a connection that wait to be sent, encrypted.
#[cfg(feature = "tls")]
pub const MAX_UNSENT_BYTES: usize = 32 << 10;

/// The stream of a connection's decrypted bytes: a socket, TLS over a socket, or the line of a simulation.
pub trait ByteStream: AsyncRead + AsyncWrite + Debug + Send + Unpin {}

impl<T: AsyncRead + AsyncWrite + Debug + Send + Unpin> ByteStream for T {}

/// Any stream of bytes.
pub type Transport = Box<dyn ByteStream>;

/// How the connections of a service begin.
#[derive(Debug, Clone)]
pub enum Security {
    /// With the first request.
    Plain,
    /// With a TLS handshake, in which the client gets this certificate.
    #[cfg(feature = "tls")]
    Tls(Certificate),
}

/// The kind of a connection, as its first bytes show.
#[derive(Debug)]
pub enum Begun {
    /// A connection for the service's requests.
    AsConfigured(Transport),
    /// A connection of a client that speaks plain HTTP although the service has TLS.
    #[cfg(feature = "tls")]
    WithoutTls(Transport),
}

impl Security {
    /// The scheme of the service's address.
    pub fn scheme(&self) -> &'static str {
        match self {
            Self::Plain => "http",
            #[cfg(feature = "tls")]
            Self::Tls(_) => "https",
        }
    }

    /// Whether connections begin with a TLS handshake.
    pub fn has_tls(&self) -> bool {
        !matches!(self, Self::Plain)
    }

    /// Waits for the first bytes of a client, where the service has TLS, and makes the handshake.
    ///
    /// # Errors
    /// The connection breaks, or the client and the service do not agree.
    pub async fn begin(&self, stream: TcpStream) -> io::Result<Begun> {
        match self {
            Self::Plain => Ok(Begun::AsConfigured(Box::new(stream))),
            #[cfg(feature = "tls")]
            Self::Tls(certificate) => {
                let mut first = [0];
                match stream.peek(&mut first).await? {
                    0 => Err(io::ErrorKind::UnexpectedEof.into()),
                    _ if first[0] != HANDSHAKE_RECORD => Ok(Begun::WithoutTls(Box::new(stream))),
                    _ => {
                        let limit = |connection: &mut rustls::ServerConnection| {
                            connection.set_buffer_limit(Some(MAX_UNSENT_BYTES));
                        };
                        let accepted = certificate.acceptor().accept_with(stream, limit).await?;
                        Ok(Begun::AsConfigured(Box::new(accepted)))
                    }
                }
            }
        }
    }
}
