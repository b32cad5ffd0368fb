//! A script with its keys and arguments, and what runs it.

use bytes::Bytes;
use redis::aio::ConnectionLike;
use redis::{Pipeline, RedisError, RedisFuture, RedisResult, ScriptInvocation, ToRedisArgs, Value};
use std::fmt;
use std::time::Duration;

/// A hash with one field, which is made in one transaction with a script.
#[derive(Debug, Clone)]
pub struct NewHash {
    /// Its key.
    pub key: String,
    /// The name of the field.
    pub field: &'static str,
    /// What the field has.
    pub value: Bytes,
    /// How long the hash lives.
    pub ttl: Duration,
}

/// What runs the scripts of a store in place of a Redis: the server of a simulation.
pub trait ScriptServer: fmt::Debug + Send + Sync {
    /// Makes the hash, where there is one, and runs this script, all of it or nothing.
    ///
    /// # Errors
    /// It is not known whether it ran; or the server refuses it.
    fn run<'a>(
        &'a self,
        new: Option<&'a NewHash>,
        script: &'a str,
        keys: &'a [String],
        args: &'a [Vec<u8>],
    ) -> RedisFuture<'a, Value>;
}

pub(super) struct Script {
    text: String,
    hashed: redis::Script,
}

/// A script with its keys and arguments. It can be run again.
pub(super) struct ScriptCall<'a> {
    script: &'a Script,
    keys: Vec<String>,
    args: Vec<Vec<u8>>,
    new: Option<NewHash>,
}

impl Script {
    pub(super) fn new(text: &str) -> Self {
        Self {
            text: text.to_owned(),
            hashed: redis::Script::new(text),
        }
    }

    pub(super) fn key(&self, key: impl Into<String>) -> ScriptCall<'_> {
        ScriptCall {
            script: self,
            keys: vec![key.into()],
            args: Vec::new(),
            new: None,
        }
    }
}

impl ScriptCall<'_> {
    /// On this key too.
    pub(super) fn key(&mut self, key: impl Into<String>) -> &mut Self {
        self.keys.push(key.into());
        self
    }

    pub(super) fn arg(&mut self, arg: impl ToRedisArgs) -> &mut Self {
        self.args.extend(arg.to_redis_args());
        self
    }

    /// On this hash too, which is made in one transaction with the script. A server that refuses the transaction gets
    /// the value as the last argument.
    pub(super) fn on_new(&mut self, new: NewHash) -> &mut Self {
        self.key(new.key.clone());
        self.new = Some(new);
        self
    }

    /// Lets a Redis run it.
    pub(super) async fn invoke(&self, link: &mut impl ConnectionLike) -> RedisResult<Value> {
        let mut invocation = self.script.hashed.prepare_invoke();
        for key in &self.keys {
            invocation.key(key);
        }
        for arg in &self.args {
            invocation.arg(&arg[..]);
        }
        if let Some(new) = &self.new {
            let done = transaction(new, &invocation).query_async(link).await;
            let is_refused = |error: &RedisError| error.clone().into_server_errors().is_some();
            match done {
                // It does not know the script, or is not the node of this session any more, or has no room. What it
                // says to the script alone is acted upon.
                Err(error) if is_refused(&error) => invocation.arg(&new.value[..]),
                done => return done.map(|(answer,)| answer),
            };
        }
        invocation.invoke_async(link).await
    }

    /// Lets this server run it.
    pub(super) async fn run_at(&self, server: &dyn ScriptServer) -> RedisResult<Value> {
        let new = self.new.as_ref();
        server
            .run(new, &self.script.text, &self.keys, &self.args)
            .await
    }
}

/// The hash is made, then the script runs: nothing comes between.
fn transaction(new: &NewHash, script: &ScriptInvocation<'_>) -> Pipeline {
    let ttl = i64::try_from(new.ttl.as_millis()).unwrap_or(i64::MAX);
    let mut transaction = redis::pipe();
    transaction.atomic();
    transaction
        .hset(&new.key, new.field, &new.value[..])
        .ignore();
    transaction.pexpire(&new.key, ttl).ignore();
    transaction.invoke_script(script);
    transaction
}
