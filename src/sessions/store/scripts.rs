//! The scripts that Redis runs, each as a whole.
//!
//! They answer `{0}` where there is no record, `{1, ttl}` where what was asked for was done, and `{2, ttl, record}`
//! where the record has another version.

use redis::Script;

/// Tells the record. `takes_over` says whether the replica that asks goes on from the checkpoint.
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

/// ARGV: generation, frame, token, head, state, milliseconds to live.
const CREATE: &str = r"
local key = KEYS[1]
local token = redis.call('HGET', key, 'token')
if token == ARGV[3] then return {1, 0} end
if token then return tell(key, false) end
redis.call('HSET', key, 'generation', ARGV[1], 'frame', ARGV[2], 'checkpoint', ARGV[2],
  'token', ARGV[3], 'head', ARGV[4], 'state', ARGV[5])
redis.call('PEXPIRE', key, ARGV[6])
return {1, ARGV[6]}
";

/// ARGV: generation, frame before, frame after, token, milliseconds to live, and the state where it is written.
const ADVANCE: &str = r"
local key = KEYS[1]
local generation, frame, token = unpack(redis.call('HMGET', key, 'generation', 'frame', 'token'))
if not generation then return {0} end
if token == ARGV[4] then return {1, 0} end
if generation ~= ARGV[1] or frame ~= ARGV[2] then return tell(key, true) end
redis.call('HSET', key, 'frame', ARGV[3], 'token', ARGV[4])
if ARGV[6] then redis.call('HSET', key, 'checkpoint', ARGV[3], 'state', ARGV[6]) end
redis.call('PEXPIRE', key, ARGV[5])
return {1, ARGV[5]}
";

/// ARGV: generation, frame, whether the replica goes on from the record ('1' or ''), and milliseconds to live where the
/// record is to live on.
const CHECK: &str = r"
local key = KEYS[1]
local generation, frame = unpack(redis.call('HMGET', key, 'generation', 'frame'))
if not generation then return {0} end
if ARGV[4] then redis.call('PEXPIRE', key, ARGV[4]) end
if generation ~= ARGV[1] or frame ~= ARGV[2] then return tell(key, ARGV[3] == '1') end
return {1, redis.call('PTTL', key)}
";

/// ARGV: generation, frame. The next generation begins where they are the newest.
const FENCE: &str = r"
local key = KEYS[1]
local generation, frame = unpack(redis.call('HMGET', key, 'generation', 'frame'))
if not generation then return {0} end
if generation ~= ARGV[1] or frame ~= ARGV[2] then return tell(key, true) end
redis.call('HINCRBY', key, 'generation', 1)
return {1, redis.call('PTTL', key)}
";

/// ARGV: an id, milliseconds to live. Answers the id that came first under this key.
const CLAIM: &str = r"
local id = redis.call('GET', KEYS[1])
if id then return id end
redis.call('SET', KEYS[1], ARGV[1], 'PX', ARGV[2])
return ARGV[1]
";

pub(super) struct Scripts {
    pub(super) create: Script,
    pub(super) advance: Script,
    pub(super) check: Script,
    pub(super) fence: Script,
    pub(super) claim: Script,
}

impl Scripts {
    pub(super) fn new() -> Self {
        let telling = |body: &str| Script::new(&format!("{TELL}{body}"));
        Self {
            create: telling(CREATE),
            advance: telling(ADVANCE),
            check: telling(CHECK),
            fence: telling(FENCE),
            claim: Script::new(CLAIM),
        }
    }
}
