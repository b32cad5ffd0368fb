//! A fault of the crate multer, and that the service is not affected by it. See docs/upstream/multer.md.

use crate::application::{TestApplication, expect_problem};
use crate::helpers::raw::RawConnection;
use crate::program::Program;
use axum::body::Bytes;
use bagtrack_testing::cpu_time;
use futures_util::FutureExt;
use multer::Multipart;
use reqwest::Method;
use std::convert::Infallible;
use std::task::Poll;

const PIECE: &[u8] = b"xxxx";

/// Seconds of this thread's processor time that multer takes for this number of pieces before the first part, given
/// one by one.
fn multer_alone(pieces: usize) -> f64 {
    let look = || {
        let (mut left, mut comes) = (pieces, false);
        // `Pending` before each piece, so that the parser works on the pieces so far.
        let body = futures_util::stream::poll_fn(move |cx| {
            comes = !comes;
            if !comes {
                cx.waker().wake_by_ref();
                return Poll::Pending;
            }
            left = left.saturating_sub(1);
            Poll::Ready((left > 0).then(|| Ok::<_, Infallible>(Bytes::from_static(PIECE))))
        });
        let mut form = Multipart::new(body, "b");
        let next = async { form.next_field().await.is_err() };
        let mut next = Box::pin(next);
        while next.as_mut().now_or_never().is_none() {}
    };
    cpu_time::medians(3, vec![Box::new(look)])[0]
}

/// If this test fails, multer no longer has the fault: remove `Stepwise` and the limit of heads in `multipart.rs`.
#[test]
fn multer_alone_looks_through_all_that_it_has_for_each_piece() {
    let (short, long) = (multer_alone(16_000), multer_alone(64_000));
    println!("{:.1} and {:.1} ms", short * 1e3, long * 1e3);
    assert!(long > 7.0 * short, "{short} s and {long} s: in proportion?");
}

/// Seconds of the service's processor time for a form with a file of this many bytes, sent in pieces of four.
async fn cost(service: &Program, bytes: usize) -> f64 {
    let head = "POST /sessions?box=1,1,9,9 HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
        Content-Type: multipart/form-data; boundary=b\r\nTransfer-Encoding: chunked\r\n\r\n";
    let part = b"--b\r\nContent-Disposition: form-data; name=\"frame\"; filename=\"a\"\r\n\r\n";
    // Each line of the file begins like the boundary.
    let file = b"\r\n--a".iter().copied().cycle().take(bytes);
    let form: Vec<u8> = part
        .iter()
        .copied()
        .chain(file)
        .chain(*b"\r\n--b--\r\n")
        .collect();
    let mut request = head.as_bytes().to_vec();
    for piece in form.chunks(PIECE.len()) {
        request.extend(format!("{:x}\r\n", piece.len()).bytes());
        request.extend_from_slice(piece);
        request.extend_from_slice(b"\r\n");
    }
    request.extend_from_slice(b"0\r\n\r\n");
    let before = cpu_time::of_process(service.process_id());
    let mut connection = RawConnection::open(service.address).await;
    connection.send(&request).await;
    let answer = connection.read_to_end().await;
    assert!(answer.starts_with("HTTP/1.1 415"), "{answer}");
    cpu_time::of_process(service.process_id()) - before
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_form_in_pieces_of_four_bytes_takes_time_in_proportion_to_its_size() {
    let service = Program::start(&[], &[]);
    cost(&service, 64 << 10).await;
    let (short, long) = (
        cost(&service, 512 << 10).await,
        cost(&service, 4 << 20).await,
    );
    println!("{short:.2} and {long:.2} s");
    // The long file has eight times the bytes; if each piece were searched with all before it, it would cost 64 times.
    assert!(long < 20.0 * short.max(0.05), "{short} s and {long} s");
}

#[tokio::test]
async fn a_form_whose_boundary_is_longer_than_one_may_be_is_refused() {
    let app = TestApplication::start().await;
    let part = "Content-Disposition: form-data; name=\"box\"\r\n\r\n1,1,9,9\r\n";
    for (length, slug) in [(70, "missing-frame"), (1_000, "malformed-request")] {
        let boundary = "b".repeat(length);
        let request = app.request(Method::POST, "/sessions", &[]);
        let request = request.header(
            "content-type",
            format!("multipart/form-data; boundary={boundary}"),
        );
        let form = format!("--{boundary}\r\n{part}--{boundary}--\r\n");
        expect_problem(request.body(form).send().await.unwrap(), slug).await;
    }
}
