//! The scripts that Redis runs, each as a whole.
//!
//! KEYS: the key of the record, and the key of the mark that the session was ended. In a cluster all keys of a session
//! are at one node.
//!
//! Scripts answer `{0}` where there is no record, `{1, ttl}` where what was asked for was done, `{2, ttl, record}`
//! where the record has another version, and `{3}` where the session was ended.

use crate::planted::PlantedFault;
use bytes::Bytes;
use redis::aio::ConnectionLike;
use redis::{Pipeline, RedisError, RedisFuture, RedisResult, ScriptInvocation, ToRedisArgs, Value};
use std::fmt;
use std::time::Duration;

/// A hash with one field, which is made in one transaction with a script.
#[derive(Debug, Clone)]
pub struct NewHash {
    /// The hash's key.
    pub key: String,
    /// The name of the field.
    pub field: &'static str,
    /// The field's value.
    pub value: Bytes,
    /// How long the hash lives.
    pub ttl: Duration,
}

/// A stand-in for a Redis that runs the scripts of a store: the server of a simulation.
pub trait ScriptServer: fmt::Debug + Send + Sync {
    /// Makes the hash `new`, where given, and runs the script: both or neither.
    ///
    /// # Errors
    /// The server refuses the script, or does not tell whether it ran.
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
    pub(super) fn key(&mut self, key: impl Into<String>) -> &mut Self {
        self.keys.push(key.into());
        self
    }

    pub(super) fn arg(&mut self, arg: impl ToRedisArgs) -> &mut Self {
        self.args.extend(arg.to_redis_args());
        self
    }

    /// Adds the key of a hash that is made in one transaction with the script. A server that refuses the transaction
    /// gets the script alone, with the hash's value as its last argument.
    pub(super) fn on_new(&mut self, new: NewHash) -> &mut Self {
        self.key(new.key.clone());
        self.new = Some(new);
        self
    }

    /// Runs the script at a Redis.
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
                // The server does not know the script, is not the node of this session any more, or has no room. The
                // client library handles the first two where the script is sent alone.
                Err(error) if is_refused(&error) => invocation.arg(&new.value[..]),
                done => return done.map(|(answer,)| answer),
            };
        }
        invocation.invoke_async(link).await
    }

    /// Runs the script at this server.
    pub(super) async fn run_at(&self, server: &dyn ScriptServer) -> RedisResult<Value> {
        let new = self.new.as_ref();
        server
            .run(new, &self.script.text, &self.keys, &self.args)
            .await
    }
}

/// The transaction that makes the hash, and then runs the script.
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

/// Answers for a missing record: whether its session was ended.
const ABSENT: &str = r"
local function absent()
  if redis.call('EXISTS', KEYS[2]) == 1 then return {3} end
  return {0}
end
";

/// Answers the record at its checkpoint. With `takes_over` the replica that asks goes on from there; where frames came
/// after the checkpoint, this begins the next generation.
const TELL: &str = r"
local function tell(key, takes_over)
  local frame, checkpoint = unpack(redis.call('HMGET', key, 'frame', 'checkpoint'))
  if takes_over and frame ~= checkpoint then
    redis.call('HINCRBY', key, 'generation', 1)
    redis.call('HSET', key, 'frame', checkpoint, 'token', '')
  end
  local fields = redis.call('HMGET', key, 'generation', 'checkpoint', 'head', 'state')
  return {2, redis.call('PTTL', key), fields}
end
";

/// Whether a server with a bound of memory has used more than nine tenths of it. At the bound it refuses writes.
const NEARLY_FULL: &str = r"
local function nearly_full()
  local memory = redis.call('INFO', 'memory')
  local most = tonumber(string.match(memory, 'maxmemory:(%d+)')) or 0
  local used = tonumber(string.match(memory, 'used_memory:(%d+)')) or 0
  return most > 0 and used > 0.9 * most
end
";

/// ARGV: generation, frame, token, incarnation, head, state, milliseconds to live. Answers `{4}` where there is no
/// room.
const CREATE: &str = r"
local key = KEYS[1]
local token = redis.call('HGET', key, 'token')
if token == ARGV[3] then return {1, 0} end
if token then return tell(key, false) end
if redis.call('EXISTS', KEYS[2]) == 1 then return {3} end
if nearly_full() then return {4} end
redis.call('HSET', key, 'generation', ARGV[1], 'frame', ARGV[2], 'checkpoint', ARGV[2],
  'token', ARGV[3], 'incarnation', ARGV[4], 'head', ARGV[5], 'state', ARGV[6])
redis.call('PEXPIRE', key, ARGV[7])
return {1, ARGV[7]}
";

/// ARGV: incarnation, milliseconds for which the session is known to have ended. Answers 0 where it had ended before.
/// The script deletes first, which makes room, so it works where the memory is used up.
const END: &str = r"
local key, ended = KEYS[1], KEYS[2]
local incarnation = redis.call('HGET', key, 'incarnation')
local is_here = incarnation == ARGV[1] or (not incarnation and redis.call('EXISTS', ended) == 0)
if incarnation == ARGV[1] then redis.call('DEL', key) end
redis.call('SET', ended, '', 'PX', ARGV[2])
return is_here and 1 or 0
";

/// ARGV: generation, frame before, frame after, token, milliseconds to live, whether the replica goes on from the
/// record where it has another version ('1' or ''), and the state where it is written. Where the state is written, the
/// third of KEYS is a hash with the state alone, which becomes the record: Lua would copy and hash each byte of a state
/// among ARGV. ARGV has the state only after the server refused the transaction that makes the hash.
const COMMIT: &str = r"
local key, new = KEYS[1], KEYS[3]
if new and ARGV[7] then
  -- Redis refuses a script's writes for want of memory unless it has written before.
  if redis.call('EXISTS', new) == 1 then redis.call('DEL', new) end
  new = nil
end
local generation, frame, token, incarnation, head =
  unpack(redis.call('HMGET', key, 'generation', 'frame', 'token', 'incarnation', 'head'))
local function without_new(answer)
  if new then redis.call('DEL', new) end
  return answer
end
if not generation then return without_new(absent()) end
if token == ARGV[4] then return without_new({1, 0}) end
if generation ~= ARGV[1] or frame ~= ARGV[2] then return without_new(tell(key, ARGV[6] == '1')) end
if new then
  redis.call('RENAME', new, key)
  redis.call('HSET', key, 'generation', generation, 'incarnation', incarnation, 'head', head, 'checkpoint', ARGV[3])
elseif ARGV[7] then
  redis.call('HSET', key, 'checkpoint', ARGV[3], 'state', ARGV[7])
end
redis.call('HSET', key, 'frame', ARGV[3], 'token', ARGV[4])
redis.call('PEXPIRE', key, ARGV[5])
return {1, ARGV[5]}
";

/// ARGV: generation, frame, whether the replica goes on from the record ('1' or ''), and milliseconds to live where the
/// record is to live on.
const CHECK: &str = r"
local key = KEYS[1]
local generation, frame = unpack(redis.call('HMGET', key, 'generation', 'frame'))
if not generation then return absent() end
if ARGV[4] then redis.call('PEXPIRE', key, ARGV[4]) end
if generation ~= ARGV[1] or frame ~= ARGV[2] then return tell(key, ARGV[3] == '1') end
return {1, redis.call('PTTL', key)}
";

/// ARGV: generation, frame. If the record has this version, the next generation begins.
const FENCE: &str = r"
local key = KEYS[1]
local generation, frame = unpack(redis.call('HMGET', key, 'generation', 'frame'))
if not generation then return absent() end
if generation ~= ARGV[1] or frame ~= ARGV[2] then return tell(key, true) end
redis.call('HINCRBY', key, 'generation', 1)
return {1, redis.call('PTTL', key)}
";

/// ARGV: a new secret, milliseconds for which the key lives after each call. Answers the secret of the first call.
const SECRET: &str = r"
local secret = redis.call('GET', KEYS[1])
if secret then
  redis.call('PEXPIRE', KEYS[1], ARGV[2])
  return secret
end
redis.call('SET', KEYS[1], ARGV[1], 'PX', ARGV[2])
return ARGV[1]
";

/// KEYS: the key of a client, a sorted set of its sessions as `id:incarnation:places:bytes`, with the time (in
/// milliseconds) when each was checked last. ARGV: member, time, most places, most bytes, milliseconds to keep the key,
/// most members to answer. Answers whether the session is counted and, where it is not, the members that were checked
/// longest ago.
const ADMIT: &str = r"
local places, bytes = 0, 0
local function count(member)
  local of_one, its_bytes = string.match(member, ':(%d+):(%d+)$')
  places, bytes = places + tonumber(of_one), bytes + tonumber(its_bytes)
end
for _, member in ipairs(redis.call('ZRANGE', KEYS[1], 0, -1)) do count(member) end
count(ARGV[1])
if places > tonumber(ARGV[3]) or bytes > tonumber(ARGV[4]) then
  return {0, redis.call('ZRANGE', KEYS[1], 0, ARGV[6] - 1)}
end
redis.call('ZADD', KEYS[1], ARGV[2], ARGV[1])
redis.call('PEXPIRE', KEYS[1], ARGV[5])
return {1, {}}
";

/// KEYS: the key of a client. ARGV: a member of its set, and the time when its session was checked; 0 if the session
/// has ended.
const RECOUNT: &str = r"
if ARGV[2] == '0' then return redis.call('ZREM', KEYS[1], ARGV[1]) end
return redis.call('ZADD', KEYS[1], 'XX', ARGV[2], ARGV[1])
";

/// KEYS: the key of a record. ARGV: incarnation. Answers whether the session lives.
const LIVES: &str = r"
return redis.call('HGET', KEYS[1], 'incarnation') == ARGV[1]
";

/// Fails if the store takes no writes. Answers whether it has no room for new sessions.
const PROBE: &str = r"
redis.call('HSET', KEYS[1], 'token', '')
redis.call('PEXPIRE', KEYS[1], 1000)
return nearly_full() and 1 or 0
";

pub(super) struct Scripts {
    pub(super) create: Script,
    pub(super) commit: Script,
    pub(super) check: Script,
    pub(super) fence: Script,
    pub(super) secret: Script,
    pub(super) end: Script,
    pub(super) probe: Script,
    pub(super) admit: Script,
    pub(super) recount: Script,
    pub(super) lives: Script,
}

impl Scripts {
    pub(super) fn new() -> Self {
        let (create, commit) = planted();
        let telling = |body: &str| Script::new(&format!("{ABSENT}{TELL}{body}"));
        Self {
            create: telling(&format!("{NEARLY_FULL}{create}")),
            commit: telling(&commit),
            check: telling(CHECK),
            fence: telling(FENCE),
            secret: Script::new(SECRET),
            end: Script::new(END),
            probe: Script::new(&format!("{NEARLY_FULL}{PROBE}")),
            admit: Script::new(ADMIT),
            recount: Script::new(RECOUNT),
            lives: Script::new(LIVES),
        }
    }
}

/// The scripts that create and commit, without the lines that a planted fault leaves out.
fn planted() -> (String, String) {
    let (mut create, mut commit) = (CREATE.to_owned(), COMMIT.to_owned());
    if PlantedFault::OpensTwice.is_here() {
        create = create.replace("if token then return tell(key, false) end", "");
    }
    if PlantedFault::CommitsOutOfOrder.is_here() {
        commit = commit.replace("or frame ~= ARGV[2] ", "");
    }
    if PlantedFault::LivesForEver.is_here() {
        create = create.replace("redis.call('PEXPIRE', key, ARGV[7])", "");
        commit = commit.replace("'PEXPIRE', key, ARGV[5]", "'PEXPIRE', key, '9999999999999'");
    }
    (create, commit)
}
