//! A connection from a caller to a replica, over a network with faults. Streams use it.

use crate::network::Wire;
use bagtrack_sessions::clock::sleep;
use std::future::pending;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, DuplexStream, duplex, split};
use tokio::sync::watch;

/// The most bytes that a line holds until its other end reads them.
const BUFFER: usize = 64 << 10;

/// What happens to bytes on the line.
enum Fate {
    Arrives,
    /// The line breaks, and both ends notice.
    Breaks,
    /// Nothing more comes from this side, and nobody notices.
    Silent,
}

impl Wire {
    /// Connects to a random replica that is ready, and returns the caller's end; `None` if no replica is ready.
    pub fn connect(&self) -> Option<DuplexStream> {
        let ready = self.cluster.ready();
        let chance = &self.cluster.setup().chance;
        let place = (!ready.is_empty()).then(|| *chance.one_of(&ready))?;
        let replica = self.cluster.at(place)?;
        self.cluster
            .setup()
            .trace
            .note(format_args!("{} connects to {}", self.caller, replica.name));
        let (caller, near) = duplex(BUFFER);
        let (far, server) = duplex(BUFFER);
        replica.connect(server);
        let (near, far) = (split(near), split(far));
        let broken = watch::Sender::new(false);
        let rates = &self.cluster.setup().rates;
        let there = self
            .clone()
            .convey(near.0, far.1, rates.request_lost, broken.clone());
        let back = self
            .clone()
            .convey(far.0, near.1, rates.answer_lost, broken);
        tokio::spawn(there);
        tokio::spawn(back);
        Some(caller)
    }

    /// Carries bytes one way, in order, until the sender ends or the line breaks. Bytes on their way still arrive after
    /// the sender has gone.
    async fn convey(
        self,
        mut from: impl AsyncRead + Unpin,
        mut to: impl AsyncWrite + Unpin,
        lost: f64,
        broken: watch::Sender<bool>,
    ) {
        let mut is_broken = broken.subscribe();
        let mut bytes = vec![0; BUFFER];
        loop {
            let read = tokio::select! {
                biased;
                _ = is_broken.wait_for(|broken| *broken) => return,
                read = from.read(&mut bytes) => read,
            };
            let Ok(length @ 1..) = read else {
                self.end_late().await;
                let _ = to.shutdown().await;
                return;
            };
            self.latency().await;
            let fate = self.fate(lost);
            let arriving = match fate {
                Fate::Arrives => length,
                // The bytes may be cut off in the middle of a message.
                Fate::Breaks | Fate::Silent => self.cluster.setup().chance.between(0..length),
            };
            if *is_broken.borrow() || to.write_all(&bytes[..arriving]).await.is_err() {
                return;
            }
            match fate {
                Fate::Arrives => {}
                Fate::Breaks => {
                    broken.send_replace(true);
                    return;
                }
                Fate::Silent => pending().await,
            }
        }
    }

    /// The end of a line often arrives late: a machine that has gone closes no connections.
    async fn end_late(&self) {
        let setup = self.cluster.setup();
        if setup.rates.happens(&setup.chance, 0.5) {
            sleep(setup.chance.millis(0..30_000)).await;
        }
    }

    async fn latency(&self) {
        let setup = self.cluster.setup();
        let takes = match setup.rates.happens(&setup.chance, setup.rates.request_late) {
            true => setup.chance.millis(50..4000),
            false => setup.chance.millis(0..5),
        };
        sleep(takes).await;
    }

    fn fate(&self, lost: f64) -> Fate {
        let setup = self.cluster.setup();
        if !setup.rates.happens(&setup.chance, lost) {
            return Fate::Arrives;
        }
        setup
            .trace
            .note(format_args!("{}: the line of a stream breaks", self.caller));
        match setup.chance.happens(0.7) {
            true => Fate::Breaks,
            false => Fate::Silent,
        }
    }
}
