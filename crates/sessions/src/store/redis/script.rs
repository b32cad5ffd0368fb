//! A script with its keys and arguments, and what runs it.

use redis::aio::ConnectionLike;
use redis::{RedisFuture, RedisResult, ToRedisArgs, Value};
use std::fmt;

/// What runs the scripts of a store in place of a Redis: the server of a simulation.
pub trait ScriptServer: fmt::Debug + Send + Sync {
    /// Runs this script, all of it or nothing.
    ///
    /// # Errors
    /// It is not known whether it ran; or the server refuses it.
    fn run<'a>(
        &'a self,
        script: &'a str,
        keys: &'a [String],
        args: &'a [Vec<u8>],
    ) -> RedisFuture<'a, Value>;

    /// Answers, where the server is there.
    ///
    /// # Errors
    /// There is no answer.
    fn ping(&self) -> RedisFuture<'_, Value>;
}

/// A script.
pub(super) struct Script {
    text: String,
    hashed: redis::Script,
}

/// A script with its keys and arguments. It can be run again.
pub(super) struct ScriptCall<'a> {
    script: &'a Script,
    keys: Vec<String>,
    args: Vec<Vec<u8>>,
}

impl Script {
    pub(super) fn new(text: &str) -> Self {
        Self {
            text: text.to_owned(),
            hashed: redis::Script::new(text),
        }
    }

    /// The script on this key.
    pub(super) fn key(&self, key: impl Into<String>) -> ScriptCall<'_> {
        ScriptCall {
            script: self,
            keys: vec![key.into()],
            args: Vec::new(),
        }
    }
}

impl ScriptCall<'_> {
    /// On this key too.
    pub(super) fn key(&mut self, key: impl Into<String>) -> &mut Self {
        self.keys.push(key.into());
        self
    }

    /// With this argument too.
    pub(super) fn arg(&mut self, arg: impl ToRedisArgs) -> &mut Self {
        self.args.extend(arg.to_redis_args());
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
        invocation.invoke_async(link).await
    }

    /// Lets this server run it.
    pub(super) async fn run_at(&self, server: &dyn ScriptServer) -> RedisResult<Value> {
        server.run(&self.script.text, &self.keys, &self.args).await
    }
}
