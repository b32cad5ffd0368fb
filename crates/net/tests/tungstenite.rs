//! A fault of tungstenite by itself, which [`Fragments`](bagtrack_net::Fragments) guard against. If this test fails,
//! the fault is mended: docs/upstream/tungstenite.md then says which code can go.

use std::io::Cursor;
use tungstenite::protocol::{Role, WebSocket};

#[test]
fn tungstenite_alone_makes_room_for_a_frame_of_which_the_head_has_come() {
    const ANNOUNCED: u64 = 12 << 20;
    let mut head = vec![0x82, 0xFF];
    head.extend(ANNOUNCED.to_be_bytes());
    // The mask, and three bytes of the payload.
    head.extend([0; 4 + 3]);
    let mut socket = WebSocket::from_raw_socket(Cursor::new(head), Role::Server, None);
    let used = allocation_counter::measure(|| assert!(socket.read().is_err(), "more has to come"));
    println!("{} bytes for a frame of {ANNOUNCED}", used.bytes_max);
    assert!(used.bytes_max >= ANNOUNCED);
}
