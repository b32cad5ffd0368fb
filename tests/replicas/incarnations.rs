//! Sessions with the same id, one after the other.

use crate::clip::Clip;
use crate::pair::{Pair, json};
use crate::processes::Redis;
use crate::replica::Replica;
use reqwest::{Client, Response, StatusCode};
use uuid::Uuid;

#[tokio::test]
#[ignore = "needs redis"]
async fn a_request_to_open_a_session_is_compared_with_the_one_that_has_the_id_now() {
    let pair = Pair::open(&[], 3).await;
    json(pair.post(0, 1).await, StatusCode::OK).await;
    let ended = pair.client.delete(pair.url(1, "")).send().await.unwrap();
    assert_eq!(ended.status(), StatusCode::NO_CONTENT);
    let opened = json(pair.put(1, 8).await, StatusCode::CREATED).await;
    // The first replica still has the ended session in memory.
    let again = pair.put(0, 8).await;
    assert_eq!(again.headers()["replayed"], "true");
    assert_eq!(json(again, StatusCode::CREATED).await, opened);
    let other = json(pair.put(0, 7).await, StatusCode::CONFLICT).await;
    assert_eq!(other["type"], "/docs/problems#session-exists");
    json(pair.post(0, 1).await, StatusCode::OK).await;
}

const ANN: &str = "0123456789abcdef";
const BEN: &str = "fedcba9876543210";

#[tokio::test]
#[ignore = "needs redis"]
async fn an_id_that_another_owner_has_now_is_found_where_the_old_session_was() {
    let redis = Redis::start();
    let keys = format!("ann:{ANN},ben:{BEN}");
    let replica = || Replica::with_store(&redis.url(), &["--api-keys", &keys]);
    let (first, second) = (replica(), replica());
    let (client, clip) = (Client::new(), Clip::of(0, 2));
    let put = async |at: &Replica, id: Uuid, key: &str| -> Response {
        let url = at.url(&format!("/sessions/{id}?box={}", clip.first_box));
        let request = client.put(url).bearer_auth(key);
        request.body(clip.frames[0].clone()).send().await.unwrap()
    };
    let end = async |at: &Replica, id: Uuid, key: &str| {
        let request = client.delete(at.url(&format!("/sessions/{id}")));
        request.bearer_auth(key).send().await.unwrap().status()
    };
    for ann_tries_to_end_it in [false, true] {
        let id = Uuid::new_v4();
        json(put(&first, id, ANN).await, StatusCode::CREATED).await;
        assert_eq!(end(&second, id, ANN).await, StatusCode::NO_CONTENT);
        json(put(&second, id, BEN).await, StatusCode::CREATED).await;
        // The first replica still has Ann's session in memory; ending that must not end Ben's.
        if ann_tries_to_end_it {
            assert_eq!(end(&first, id, ANN).await, StatusCode::NOT_FOUND);
        }
        let post = async |at: &Replica| -> Response {
            let url = at.url(&format!("/sessions/{id}/frames?frame=1"));
            let request = client.post(url).bearer_auth(BEN);
            request.body(clip.frames[1].clone()).send().await.unwrap()
        };
        json(post(&first).await, StatusCode::OK).await;
        json(post(&second).await, StatusCode::OK).await;
    }
}
