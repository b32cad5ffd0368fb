//! A replica's connection to the Redis server, over a network with faults.

use super::server::{Server, broken};
use crate::chance::Chance;
use crate::faults::Rates;
use crate::life::Life;
use crate::trace::Trace;
use bagtrack_sessions::clock::sleep;
use bagtrack_sessions::{NewHash, ScriptServer};
use redis::{RedisFuture, RedisResult, Value};
use std::future::pending;
use std::time::Duration;

/// The connection of one replica.
#[derive(Debug, Clone)]
pub struct Line {
    /// The replica's name, for the trace.
    pub name: String,
    /// The server at its other end.
    pub server: Server,
    /// The replica's life. A dead replica sends nothing.
    pub life: Life,
    pub rates: Rates,
    pub chance: Chance,
    pub trace: Trace,
}

impl Line {
    fn latency(&self) -> Duration {
        match self.rates.happens(&self.chance, self.rates.late) {
            true => self.chance.millis(20..1500),
            false => self.chance.millis(0..3),
        }
    }

    /// Loses a message: the caller sees a broken line, or waits for ever.
    async fn lose(&self, what: &str) -> RedisResult<Value> {
        self.trace
            .note(format_args!("{} store: {what} lost", self.name));
        match self.chance.happens(0.5) {
            true => Err(broken()),
            false => pending().await,
        }
    }

    async fn deliver(&self, message: Message<'_>) -> RedisResult<Value> {
        let (_, _, epoch) = self.server.state();
        sleep(self.latency()).await;
        if self.rates.happens(&self.chance, self.rates.store_lost) {
            if self.rates.happens(&self.chance, self.rates.store_doubled) {
                self.repeat_later(&message);
            }
            return self.lose("request").await;
        }
        if self.life.is_dead() {
            return pending().await;
        }
        let (is_there, slow_by, now_epoch) = self.server.state();
        if !is_there || now_epoch != epoch {
            return Err(broken());
        }
        let answer = message.reach(&self.server);
        let told = answer
            .as_ref()
            .map_or_else(|_| "refused".to_owned(), summary);
        let key = &message.keys[0];
        self.trace
            .note(format_args!("{} store: {key} {told}", self.name));
        if self.rates.happens(&self.chance, self.rates.store_doubled) {
            self.repeat_later(&message);
        }
        sleep(self.latency() + slow_by).await;
        if self
            .rates
            .happens(&self.chance, self.rates.store_answer_lost)
        {
            return self.lose("answer").await;
        }
        match self.server.state() {
            (true, _, after) if after == epoch => answer,
            _ => Err(broken()),
        }
    }

    /// Delivers the message once more after a while, as a buffer of an abandoned connection may.
    fn repeat_later(&self, message: &Message<'_>) {
        let (line, delay) = (self.clone(), self.chance.millis(1..2500));
        let new = message.new.cloned();
        let (script, keys) = (message.script.to_owned(), message.keys.to_vec());
        let args = message.args.to_vec();
        tokio::spawn(async move {
            sleep(delay).await;
            let again = Message {
                new: new.as_ref(),
                script: &script,
                keys: &keys,
                args: &args,
            };
            let answer = again.reach(&line.server);
            let told = answer
                .as_ref()
                .map_or_else(|_| "refused".to_owned(), summary);
            line.trace.note(format_args!(
                "{} store: {} again, {told}",
                line.name, keys[0]
            ));
        });
    }
}

/// A call of a script, on its way to the server.
struct Message<'a> {
    new: Option<&'a NewHash>,
    script: &'a str,
    keys: &'a [String],
    args: &'a [Vec<u8>],
}

impl Message<'_> {
    fn reach(&self, server: &Server) -> RedisResult<Value> {
        server.run(self.new, self.script, self.keys, self.args)
    }
}

impl ScriptServer for Line {
    fn run<'a>(
        &'a self,
        new: Option<&'a NewHash>,
        script: &'a str,
        keys: &'a [String],
        args: &'a [Vec<u8>],
    ) -> RedisFuture<'a, Value> {
        Box::pin(self.deliver(Message {
            new,
            script,
            keys,
            args,
        }))
    }
}

/// The first number of an answer, which tells its kind, for the trace.
fn summary(answer: &Value) -> String {
    match answer {
        Value::Array(parts) => parts.first().map_or_else(String::new, summary),
        Value::Int(number) => number.to_string(),
        _ => "text".to_owned(),
    }
}
