//! Resident memory of the server against the number of live sessions, all with full bags.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use bagtrack_client::Client;
use bagtrack_tracker::Preset;
use tokio::task::JoinSet;

use crate::Outcome;
use crate::drive::Driver;
use crate::process::Server;

/// Numbers of sessions at which memory is read, besides the last.
const MARKS: [u32; 4] = [1000, 2000, 5000, 10_000];

/// Requests at the same time.
const CLIENTS: usize = 16;

/// Opens `sessions` sessions, sends each enough frames to fill its bag, and prints the table.
///
/// The bag takes an entry from every frame (`update_every` = 1), not from every fifth. A full bag has
/// the same size, and a fifth of the frames fill it.
pub async fn print(driver: &Driver, server: &Server, preset: Preset, sessions: u32) -> Outcome<()> {
    let params = preset.params();
    let mut driver = driver.clone();
    driver.options = driver.options.parameter("update_every", 1);
    let fill = Arc::new(Fill {
        client: driver.client(CLIENTS)?,
        driver,
        // Twice as many as the bag and the history need: `robust` skips frames that fail its update gate.
        frames: 2 * (params.bag_size + params.history),
    });
    // One session first, so that memory allocated once by the first requests is not counted.
    fill.one().await?;
    let before = server.resident()?;
    println!("server: {} MiB resident with one session", before >> 20);
    println!("| live | resident MiB | KiB each |");
    println!("|---|---|---|");
    let mut live = 1;
    for mark in MARKS
        .into_iter()
        .filter(|&mark| mark < sessions)
        .chain([sessions])
    {
        let left = Arc::new(AtomicU32::new(mark - live));
        let mut clients = JoinSet::new();
        for _ in 0..CLIENTS {
            let (fill, left) = (fill.clone(), left.clone());
            clients.spawn(async move {
                let take = |left: u32| left.checked_sub(1);
                while left
                    .fetch_update(Ordering::Relaxed, Ordering::Relaxed, take)
                    .is_ok()
                {
                    fill.one().await?;
                }
                Outcome::Ok(())
            });
        }
        while let Some(client) = clients.join_next().await {
            client??;
        }
        live = mark;
        let resident = server.resident()?;
        let each = resident.saturating_sub(before) as f64 / 1024.0 / f64::from(live - 1);
        println!("| {live} | {} | {each:.0} |", resident >> 20);
    }
    Ok(())
}

struct Fill {
    client: Client,
    driver: Driver,
    frames: u32,
}

impl Fill {
    /// Opens a session and fills its bag.
    async fn one(&self) -> Outcome<()> {
        let mut session = self.driver.session(&self.client).await?;
        let pictures = self.driver.pictures.iter().cycle().skip(1);
        for (_, picture) in (0..self.frames).zip(pictures) {
            session.track(picture.clone()).await?;
        }
        Ok(())
    }
}
