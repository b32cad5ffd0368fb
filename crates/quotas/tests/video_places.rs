//! The places for videos, of which one is given up for each waiting request.

use bagtrack_quotas::VideoPlaces;
use bagtrack_sessions::clock::{self, Instant, sleep};
use std::time::Duration;
use tokio::task::{JoinSet, yield_now};
use tokio::time::timeout;

fn after(seconds: u64) -> Instant {
    clock::now() + Duration::from_secs(seconds)
}

#[tokio::test(start_paused = true)]
async fn one_place_is_given_up_for_each_that_waits() {
    let places = VideoPlaces::new(3);
    let mut holders = JoinSet::new();
    for _ in 0..3 {
        let places = places.clone();
        let place = places.take_until(after(1)).await.unwrap();
        holders.spawn(async move {
            places.wanted_from(after(60)).await;
            // The decoder takes a while to end.
            sleep(Duration::from_secs(1)).await;
            drop(place);
            clock::now()
        });
    }
    // No place is wanted before its time, and no request waits after the deadline.
    let began = clock::now();
    assert!(places.take_until(after(30)).await.is_none());
    sleep(Duration::from_secs(100)).await;
    assert_eq!(places.taken(), 3);
    let first = places.take_until(after(30)).await.unwrap();
    let second = places.take_until(after(30)).await.unwrap();
    let gone = [(); 2].map(|()| holders.try_join_next().unwrap().unwrap());
    assert!(
        gone.iter()
            .all(|gone| *gone > began + Duration::from_secs(130))
    );
    // The third holder keeps its place, since no request waits for it.
    assert!(
        timeout(Duration::from_secs(1000), holders.join_next())
            .await
            .is_err()
    );
    drop((first, second));
    yield_now().await;
    assert_eq!(places.taken(), 1);
}

#[tokio::test(start_paused = true)]
async fn who_waits_no_more_takes_no_place_from_another() {
    let places = VideoPlaces::new(1);
    let _place = places.take_until(after(1)).await.unwrap();
    assert!(places.take_until(after(5)).await.is_none());
    let wanted = places.wanted_from(clock::now());
    assert!(timeout(Duration::from_secs(1000), wanted).await.is_err());
}
