//! From HTTP to a WebSocket: the answer to the handshake, and the connection after it.

use crate::http::problems::problem::Problem;
use axum::extract::FromRequestParts;
use axum::extract::ws::WebSocketUpgrade;
use axum::http::header::{
    CONNECTION, SEC_WEBSOCKET_ACCEPT, SEC_WEBSOCKET_KEY, SEC_WEBSOCKET_PROTOCOL, UPGRADE,
};
use axum::http::request::Parts;
use axum::http::{HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use bagtrack_net::{ConnectionIo, Fragments, Rates};
use bagtrack_sessions::Budget;
use hyper::upgrade::OnUpgrade;
use hyper_util::rt::TokioIo;
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::handshake::derive_accept_key;
use tokio_tungstenite::tungstenite::protocol::{Role, WebSocketConfig};
use tracing::Instrument;

/// The protocol that a client may offer. A page has to offer this beside its token.
const PROTOCOL: &str = "bagtrack";
/// Most bytes that tungstenite reads at once. It keeps room for so much, and for a fragment.
const READ_BYTES: usize = 16 << 10;
/// Most bytes of answers that wait to be written. Each answer is written as soon as it is there.
const WRITE_BYTES: usize = 64 << 10;

/// A WebSocket whose messages are charged as they arrive. Its buffers take the place of those that its connection had.
pub type Socket = WebSocketStream<Fragments<ConnectionIo>>;

/// The limits of a stream's messages.
#[derive(Debug)]
pub struct MessageLimits {
    /// Most bytes of a message.
    pub max_bytes: usize,
    /// The budgets to which the messages' memory is charged: of all clients, and of this one.
    pub budgets: [Budget; 2],
    /// How slowly messages may come, and how fast.
    pub rates: Rates,
}

/// A valid handshake, not yet answered.
#[derive(Debug)]
pub struct Upgrade {
    connection: OnUpgrade,
    accept: String,
    protocol: Option<HeaderValue>,
}

impl Upgrade {
    /// The handshake of a request.
    ///
    /// # Errors
    /// The request is no handshake of a WebSocket.
    pub async fn of(parts: &mut Parts) -> Result<Self, Problem> {
        let connection = parts.extensions.get::<OnUpgrade>().cloned();
        let key = parts.headers.get(SEC_WEBSOCKET_KEY).cloned();
        let checked = WebSocketUpgrade::from_request_parts(parts, &()).await;
        let checked = checked.map_err(|error| {
            Problem::malformed(format!("{error}. This call opens a WebSocket."))
        })?;
        let checked = checked.protocols([PROTOCOL]);
        let (Some(connection), Some(key)) = (connection, key) else {
            return Err(Problem::malformed("This call opens a WebSocket."));
        };
        Ok(Self {
            connection,
            accept: derive_accept_key(key.as_bytes()),
            protocol: checked.selected_protocol().cloned(),
        })
    }

    /// The answer 101. Once it is sent, a task in the span of this call gives `serve` the socket.
    pub fn answer<F, S>(self, limits: MessageLimits, serve: F) -> Response
    where
        F: FnOnce(Socket) -> S + Send + 'static,
        S: Future<Output = ()> + Send + 'static,
    {
        let connection = self.connection;
        let stream = async move {
            let Ok(upgraded) = connection.await else {
                return tracing::debug!("the connection ended before it became a stream");
            };
            let Ok(parts) = upgraded.downcast::<TokioIo<ConnectionIo>>() else {
                return tracing::error!("a stream over a connection of another kind");
            };
            let stream = parts.io.into_inner();
            let fragments = Fragments::new(stream, &parts.read_buf, limits.budgets, limits.rates);
            let config = WebSocketConfig::default()
                .read_buffer_size(READ_BYTES)
                .write_buffer_size(0)
                .max_write_buffer_size(WRITE_BYTES)
                .max_message_size(Some(limits.max_bytes))
                .max_frame_size(Some(READ_BYTES));
            let role = Role::Server;
            let socket = WebSocketStream::from_raw_socket(fragments, role, Some(config));
            serve(socket.await).await;
        };
        tokio::spawn(stream.in_current_span());
        let accept = HeaderValue::try_from(self.accept).expect("base64 is a header's value");
        let headers = [
            (CONNECTION, HeaderValue::from_static("upgrade")),
            (UPGRADE, HeaderValue::from_static("websocket")),
            (SEC_WEBSOCKET_ACCEPT, accept),
        ];
        let mut response = (StatusCode::SWITCHING_PROTOCOLS, headers).into_response();
        if let Some(protocol) = self.protocol {
            response
                .headers_mut()
                .insert(SEC_WEBSOCKET_PROTOCOL, protocol);
        }
        response
    }
}
