//! `GET /sessions/{id}/stream`: a session over a WebSocket.
//!
//! In: a binary message is a frame. A text message before it may give its number or a corrected box, or ask what the
//! tracker saw ([`message`]). Out: text messages, JSON. The first tells the number of the next frame. Where the client
//! takes up after a broken line the stored answers follow. Then each frame gets its answer or its problem, in order.
//!
//! A frame passes the same checks as a plain post: quotas, the queue, the turn of its client. Where there is no place
//! the frame waits, a few behind it wait too ([`waiting`]), and then the socket is not read: TCP holds the client back.
//! With `drop=true` the newest frame takes the place of the one that waits.
//!
//! What can go wrong: the line breaks while frames are on their way, so the last answers of a session are kept, and the
//! client asks for them. The old line may not know yet that it is broken, so a new stream ends the old one
//! ([`OpenStreams`](bagtrack_sessions::OpenStreams)). A client says nothing for long: it is pinged. A client reads no
//! answers: the connection ends by its time limit for writing. A client sends a part of a message and no more, over
//! many streams: memory is charged as messages arrive ([`Fragments`](bagtrack_net::Fragments)).

pub mod end;
pub mod frame_work;
pub mod handshake;
pub mod message;
pub mod session_stream;
pub mod upgrade;
pub mod waiting;
