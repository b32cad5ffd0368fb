//! One run: draws replicas, callers and faults from a seed, lets the callers work, and checks the result.

use crate::caller::Caller;
use crate::chance::Chance;
use crate::checks;
use crate::cluster::{Cluster, REPLICAS};
use crate::faults::{Events, Rates};
use crate::journal::Journal;
use crate::nemesis;
use crate::network::Wire;
use crate::redis::server::Server;
use crate::replica::{self, Setup};
use crate::trace::Trace;
use bagtrack_sessions::clock::{sleep, timeout};
use bagtrack_sessions::random::seed_this_thread;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Longest simulated time that a run waits for a caller after the faults have ended.
const LONGEST: Duration = Duration::from_secs(900);

/// The result of a run.
#[derive(Debug)]
pub struct Outcome {
    /// The seed of the run.
    pub seed: u64,
    /// The broken promises, in words; none where the run is good.
    pub faults: Vec<String>,
    /// What happened, line by line.
    pub trace: Vec<u8>,
    /// How many frames replicas have answered.
    pub answers: u64,
}

/// Runs the world of a seed.
pub fn run(seed: u64) -> Outcome {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_time()
        .start_paused(true)
        .build()
        .expect("a runtime of one thread");
    runtime.block_on(live(seed))
}

async fn live(seed: u64) -> Outcome {
    seed_this_thread(seed);
    replica::set_time_of_day();
    let (chance, trace, journal) = (Chance::new(seed), Trace::begin(), Journal::default());
    let rates = Rates::draw(&chance);
    let events = Events::draw(&chance);
    let setup = Setup {
        store: chance.happens(0.75).then(|| Server::new(journal.clone())),
        store_every: *chance.one_of(&[1, 1, 1, 3]),
        workers: chance.between(1..4),
        rates: rates.clone(),
        chance: chance.clone(),
        trace: trace.clone(),
    };
    trace.note(format_args!(
        "{rates:?} {events:?} every {}",
        setup.store_every
    ));
    let cluster = Cluster::start(setup).await;
    let is_quiet = Arc::new(AtomicBool::new(false));
    let callers = callers(&cluster, &journal, &is_quiet);
    let time = chance.millis(2000..30_000);
    let _ = timeout(time, nemesis::strike(&cluster, &events)).await;
    nemesis::calm(&cluster).await;
    // Messages that were sent before may still be lost or late.
    sleep(Duration::from_secs(10)).await;
    is_quiet.store(true, Ordering::Relaxed);
    for (name, caller) in callers {
        match timeout(LONGEST, caller).await {
            Ok(Ok(())) => {}
            Ok(Err(error)) => journal.fault(format!("{name} panicked: {error}")),
            Err(_) => journal.fault(format!("{name} waits for ever")),
        }
    }
    checks::all_is_given_back(&cluster, &journal).await;
    Outcome {
        seed,
        faults: journal.faults(),
        trace: trace.bytes(),
        answers: journal.answers(),
    }
}

type Running = tokio::task::JoinHandle<()>;

fn callers(
    cluster: &Cluster,
    journal: &Journal,
    is_quiet: &Arc<AtomicBool>,
) -> Vec<(String, Running)> {
    let setup = cluster.setup();
    let chance = &setup.chance;
    let http = http();
    let any = vec!["http://any".to_owned()];
    let balanced = chance.happens(0.5);
    let count = chance.between(2..5);
    (0..count)
        .map(|index| {
            let name = format!("caller {index}");
            let own = chance.between(0..REPLICAS);
            let places = (0..REPLICAS).map(|place| (own + place) % REPLICAS);
            let addresses: Vec<String> = places
                .map(|place| format!("http://replica-{place}"))
                .collect();
            // Without a store, or with one that does not get the state of each frame, a session has to stay at its
            // replica.
            let is_balanced = balanced && setup.store.is_some() && setup.store_every == 1;
            let wire = Wire {
                caller: name.clone(),
                cluster: cluster.clone(),
                journal: journal.clone(),
            };
            let every = *chance.one_of(&[1, 3, 30]);
            let addresses = if is_balanced { &any } else { &addresses };
            // The frames of a stream have no numbers, so they cannot be sent again: the store has to have each state.
            let streams = match setup.store.is_some() && setup.store_every == 1 {
                true => 0.4,
                false => 0.0,
            };
            let caller = Caller {
                name: name.clone(),
                client: Caller::client(wire.clone(), http.clone(), addresses, every),
                wire,
                streams,
                chance: chance.clone(),
                rates: setup.rates.clone(),
                trace: setup.trace.clone(),
                journal: journal.clone(),
                is_quiet: is_quiet.clone(),
                idle: replica::IDLE,
            };
            (name, tokio::spawn(caller.run()))
        })
        .collect()
}

/// The client builds its requests with this, and sends none by it. All runs of a thread share it.
fn http() -> reqwest::Client {
    thread_local! {
        static HTTP: reqwest::Client = reqwest::Client::new();
    }
    HTTP.with(Clone::clone)
}
