//! The faults that happen to replicas and the store while the callers work.

use crate::cluster::{Cluster, REPLICAS};
use crate::faults::Events;
use bagtrack_sessions::clock::sleep;
use std::time::Duration;

/// A fault of a replica or of the store.
#[derive(Debug, Clone, Copy)]
enum Event {
    Kill,
    Drain,
    StoreAway,
    StoreSlow,
    StoreRestart,
    ClockJump,
}

/// Lets faults happen at random times, for as long as the future is polled.
pub async fn strike(cluster: &Cluster, events: &Events) {
    let among = choices(events);
    let chance = cluster.setup().chance.clone();
    while !among.is_empty() {
        sleep(chance.millis(100..8000)).await;
        happen(cluster, *chance.one_of(&among)).await;
    }
}

fn choices(events: &Events) -> Vec<Event> {
    let weights = [
        (Event::Kill, events.kill),
        (Event::Drain, events.drain),
        (Event::StoreAway, events.store_away),
        (Event::StoreSlow, events.store_slow),
        (Event::StoreRestart, events.store_restart),
        (Event::ClockJump, events.clock_jump),
    ];
    let weights = weights.into_iter();
    weights
        .flat_map(|(event, weight)| std::iter::repeat_n(event, weight as usize))
        .collect()
}

async fn happen(cluster: &Cluster, event: Event) {
    let setup = cluster.setup();
    let chance = &setup.chance;
    let index = chance.between(0..REPLICAS);
    match event {
        Event::Kill => kill(cluster, index).await,
        Event::Drain => {
            let delay = chance.millis(500..6000);
            cluster.drain(index, delay).await;
            restart(cluster, index).await;
        }
        Event::ClockJump => {
            let by = chance.millis(1000..60_000);
            if let Some(replica) = cluster.at(index) {
                setup.trace.note(format_args!(
                    "the clock of {} jumps by {by:?}",
                    replica.name
                ));
                replica.clock.advance(by);
            }
        }
        Event::StoreAway | Event::StoreSlow | Event::StoreRestart => store(cluster, event).await,
    }
}

async fn kill(cluster: &Cluster, index: usize) {
    let chance = &cluster.setup().chance;
    let replica = cluster.at(index);
    match replica.filter(|_| chance.happens(0.7)) {
        // The replica dies at a random await point.
        Some(replica) => {
            replica.life.end_after(chance.between(1..200));
            sleep(chance.millis(10..3000)).await;
            if replica.life.is_dead() {
                cluster
                    .setup()
                    .trace
                    .note(format_args!("{} has died", replica.name));
            }
            cluster.kill(index);
        }
        None => cluster.kill(index),
    }
    restart(cluster, index).await;
}

async fn restart(cluster: &Cluster, index: usize) {
    sleep(cluster.setup().chance.millis(0..3000)).await;
    cluster.start_one(index).await;
}

async fn store(cluster: &Cluster, event: Event) {
    let setup = cluster.setup();
    let Some(server) = &setup.store else {
        return;
    };
    let chance = &setup.chance;
    match event {
        Event::StoreSlow => {
            let by = chance.millis(50..1200);
            setup
                .trace
                .note(format_args!("the store is slow by {by:?}"));
            server.slow_down(by);
            sleep(chance.millis(500..6000)).await;
            server.slow_down(Duration::ZERO);
        }
        _ => {
            setup.trace.note(format_args!("the store is away"));
            server.leave();
            let longest = if matches!(event, Event::StoreAway) {
                8000
            } else {
                50
            };
            sleep(chance.millis(0..longest)).await;
            server.come_back();
        }
    }
    setup.trace.note(format_args!("the store is there"));
}

/// Ends all faults: the store is there, and each place has a replica that lives on.
pub async fn calm(cluster: &Cluster) {
    let setup = cluster.setup();
    setup.trace.note(format_args!("no more faults"));
    setup.rates.end();
    if let Some(server) = &setup.store {
        server.come_back();
        server.slow_down(Duration::ZERO);
    }
    for index in 0..REPLICAS {
        // A replica that drains, or is about to die, is replaced.
        if cluster
            .at(index)
            .is_none_or(|replica| replica.life.is_doomed())
            || !cluster.ready().contains(&index)
        {
            cluster.kill(index);
            cluster.start_one(index).await;
        }
    }
}
