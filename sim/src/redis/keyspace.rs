//! The keys of the simulated Redis, and the commands that the store's scripts call.

use bagtrack_sessions::NewHash;
use std::collections::BTreeMap;

type Bytes = Vec<u8>;

/// The reply to a command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reply {
    Nil,
    Integer(i64),
    Bulk(Bytes),
    List(Vec<Reply>),
}

/// All keys with their values.
#[derive(Debug, Clone, Default)]
pub struct Keyspace {
    /// The time in milliseconds since the start of the server; the caller sets it before each command.
    pub now: u64,
    /// `maxmemory` and `used_memory` in bytes, as `INFO memory` tells them.
    pub memory: (u64, u64),
    entries: BTreeMap<Bytes, Entry>,
}

#[derive(Debug, Clone)]
struct Entry {
    expires: Option<u64>,
    value: Value,
}

#[derive(Debug, Clone)]
enum Value {
    Text(Bytes),
    Hash(BTreeMap<Bytes, Bytes>),
    Sorted(BTreeMap<Bytes, u64>),
}

const WRONG_TYPE: &str = "WRONGTYPE Operation against a key holding the wrong kind of value";

impl Keyspace {
    /// Runs a command, given as its words.
    ///
    /// # Errors
    /// The error that a Redis would give.
    pub fn call(&mut self, words: &[Bytes]) -> Result<Reply, String> {
        let (name, args) = words.split_first().ok_or("ERR no command")?;
        match (&name[..], args) {
            (b"EXISTS", [key]) => Ok(Reply::Integer(i64::from(self.entry(key).is_some()))),
            (b"DEL", [key]) => Ok(Reply::Integer(i64::from(self.delete(key)))),
            (b"RENAME", [from, to]) => self.rename(from, to),
            (b"GET", [key]) => self.get(key),
            (b"SET", [key, value, px, ttl]) if px == b"PX" => self.set(key, value, number(ttl)?),
            (b"HGET", [key, field]) => Ok(self.fields(key, std::slice::from_ref(field))?.remove(0)),
            (b"HMGET", [key, fields @ ..]) => self.fields(key, fields).map(Reply::List),
            (b"HSET", [key, pairs @ ..]) => self.set_fields(key, pairs),
            (b"HINCRBY", [key, field, by]) => self.count_up(key, field, number(by)?),
            (b"PTTL", [key]) => Ok(Reply::Integer(self.time_to_live(key))),
            (b"PEXPIRE", [key, ttl]) => self.expire(key, number(ttl)?),
            (b"INFO", [_]) => {
                let (most, used) = self.memory;
                let text = format!("# Memory\r\nused_memory:{used}\r\nmaxmemory:{most}\r\n");
                Ok(Reply::Bulk(text.into_bytes()))
            }
            (b"ZRANGE", [key, from, to]) => self.range(key, number(from)?, number(to)?),
            (b"ZADD", [key, score, member]) => self.add(key, number(score)?, member, false),
            (b"ZADD", [key, xx, score, member]) if xx == b"XX" => {
                self.add(key, number(score)?, member, true)
            }
            (b"ZREM", [key, member]) => {
                let removed = self.sorted(key)?.and_then(|sorted| sorted.remove(member));
                Ok(Reply::Integer(i64::from(removed.is_some())))
            }
            _ => Err(format!("ERR not simulated: {words:?}")),
        }
    }

    /// Makes a hash with one field.
    ///
    /// # Errors
    /// The error that a Redis would give.
    pub fn make_hash(&mut self, new: &NewHash) -> Result<(), String> {
        let key = new.key.as_bytes();
        self.set_fields(key, &[new.field.as_bytes().to_vec(), new.value.to_vec()])?;
        let ttl = i64::try_from(new.ttl.as_millis()).unwrap_or(i64::MAX);
        self.expire(key, ttl).map(|_| ())
    }

    pub fn field(&mut self, key: &[u8], field: &str) -> Option<Bytes> {
        match self.fields(key, &[field.as_bytes().to_vec()]).ok()?.pop()? {
            Reply::Bulk(text) => Some(text),
            _ => None,
        }
    }

    /// The keys that have not expired.
    pub fn live_keys(&mut self) -> Vec<String> {
        let now = self.now;
        self.entries
            .retain(|_, entry| entry.expires.is_none_or(|expires| expires > now));
        let keys = self.entries.keys();
        keys.map(|key| String::from_utf8_lossy(key).into_owned())
            .collect()
    }

    fn entry(&mut self, key: &[u8]) -> Option<&mut Entry> {
        let now = self.now;
        let is_over = |entry: &Entry| entry.expires.is_some_and(|expires| expires <= now);
        if self.entries.get(key).is_some_and(is_over) {
            self.entries.remove(key);
        }
        self.entries.get_mut(key)
    }

    fn delete(&mut self, key: &[u8]) -> bool {
        self.entry(key).is_some() && self.entries.remove(key).is_some()
    }

    fn rename(&mut self, from: &[u8], to: &[u8]) -> Result<Reply, String> {
        self.entry(from).ok_or("ERR no such key")?;
        let entry = self.entries.remove(from).expect("it is there");
        self.entries.insert(to.to_vec(), entry);
        Ok(Reply::Bulk(b"OK".to_vec()))
    }

    fn get(&mut self, key: &[u8]) -> Result<Reply, String> {
        match self.entry(key).map(|entry| &entry.value) {
            None => Ok(Reply::Nil),
            Some(Value::Text(text)) => Ok(Reply::Bulk(text.clone())),
            Some(_) => Err(WRONG_TYPE.to_owned()),
        }
    }

    fn set(&mut self, key: &[u8], value: &[u8], ttl: i64) -> Result<Reply, String> {
        let entry = Entry {
            expires: Some(self.moment(ttl)),
            value: Value::Text(value.to_vec()),
        };
        self.entries.insert(key.to_vec(), entry);
        Ok(Reply::Bulk(b"OK".to_vec()))
    }

    fn hash(&mut self, key: &[u8]) -> Result<Option<&mut BTreeMap<Bytes, Bytes>>, String> {
        match self.entry(key).map(|entry| &mut entry.value) {
            None => Ok(None),
            Some(Value::Hash(hash)) => Ok(Some(hash)),
            Some(_) => Err(WRONG_TYPE.to_owned()),
        }
    }

    fn fields(&mut self, key: &[u8], fields: &[Bytes]) -> Result<Vec<Reply>, String> {
        let hash = self.hash(key)?;
        let value = |field| hash.as_ref()?.get(field);
        let reply = |field| value(field).map_or(Reply::Nil, |text| Reply::Bulk(text.clone()));
        Ok(fields.iter().map(reply).collect())
    }

    fn set_fields(&mut self, key: &[u8], pairs: &[Bytes]) -> Result<Reply, String> {
        if self.hash(key)?.is_none() {
            let value = Value::Hash(BTreeMap::new());
            let expires = None;
            self.entries.insert(key.to_vec(), Entry { expires, value });
        }
        let hash = self.hash(key)?.expect("it was made");
        let mut added = 0;
        for pair in pairs.chunks(2) {
            let [field, value] = pair else {
                return Err("ERR wrong number of arguments for 'hset' command".to_owned());
            };
            added += i64::from(hash.insert(field.clone(), value.clone()).is_none());
        }
        Ok(Reply::Integer(added))
    }

    fn count_up(&mut self, key: &[u8], field: &[u8], by: i64) -> Result<Reply, String> {
        let before = self.fields(key, &[field.to_vec()])?.remove(0);
        let before = match before {
            Reply::Bulk(text) => number(&text)?,
            _ => 0,
        };
        let after = before
            .checked_add(by)
            .ok_or("ERR increment or decrement would overflow")?;
        self.set_fields(key, &[field.to_vec(), after.to_string().into_bytes()])?;
        Ok(Reply::Integer(after))
    }

    fn time_to_live(&mut self, key: &[u8]) -> i64 {
        let now = self.now;
        match self.entry(key).map(|entry| entry.expires) {
            None => -2,
            Some(None) => -1,
            Some(Some(expires)) => i64::try_from(expires.saturating_sub(now)).unwrap_or(i64::MAX),
        }
    }

    fn expire(&mut self, key: &[u8], ttl: i64) -> Result<Reply, String> {
        let moment = self.moment(ttl);
        let entry = self.entry(key);
        let is_there = entry.is_some();
        if let Some(entry) = entry {
            entry.expires = Some(moment);
        }
        Ok(Reply::Integer(i64::from(is_there)))
    }

    fn sorted(&mut self, key: &[u8]) -> Result<Option<&mut BTreeMap<Bytes, u64>>, String> {
        match self.entry(key).map(|entry| &mut entry.value) {
            None => Ok(None),
            Some(Value::Sorted(sorted)) => Ok(Some(sorted)),
            Some(_) => Err(WRONG_TYPE.to_owned()),
        }
    }

    fn add(
        &mut self,
        key: &[u8],
        score: i64,
        member: &[u8],
        must_be_there: bool,
    ) -> Result<Reply, String> {
        let score = u64::try_from(score).map_err(|_| "ERR a score below 0 is not simulated")?;
        if self.sorted(key)?.is_none() {
            if must_be_there {
                return Ok(Reply::Integer(0));
            }
            let value = Value::Sorted(BTreeMap::new());
            let expires = None;
            self.entries.insert(key.to_vec(), Entry { expires, value });
        }
        let sorted = self.sorted(key)?.expect("it was made");
        if must_be_there && !sorted.contains_key(member) {
            return Ok(Reply::Integer(0));
        }
        let is_new = sorted.insert(member.to_vec(), score).is_none();
        Ok(Reply::Integer(i64::from(is_new)))
    }

    fn range(&mut self, key: &[u8], from: i64, to: i64) -> Result<Reply, String> {
        let mut members: Vec<(u64, Bytes)> = match self.sorted(key)? {
            None => Vec::new(),
            Some(sorted) => sorted
                .iter()
                .map(|(member, score)| (*score, member.clone()))
                .collect(),
        };
        members.sort();
        let count = members.len() as i64;
        let place = |index: i64| if index < 0 { count + index } else { index };
        let (from, to) = (place(from).max(0), place(to).min(count - 1));
        let inside = (from..=to).map(|index| &members[index as usize]);
        Ok(Reply::List(
            inside
                .map(|(_, member)| Reply::Bulk(member.clone()))
                .collect(),
        ))
    }

    fn moment(&self, ttl: i64) -> u64 {
        self.now.saturating_add_signed(ttl)
    }
}

fn number(text: &[u8]) -> Result<i64, String> {
    let text = std::str::from_utf8(text).ok();
    text.and_then(|text| text.parse().ok())
        .ok_or_else(|| "ERR value is not an integer or out of range".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn call(keys: &mut Keyspace, line: &str) -> Reply {
        let words: Vec<Bytes> = line
            .split(' ')
            .map(|word| word.as_bytes().to_vec())
            .collect();
        keys.call(&words).unwrap()
    }

    #[test]
    fn keys_expire_and_times_are_told() {
        let mut keys = Keyspace::default();
        assert_eq!(call(&mut keys, "PTTL a"), Reply::Integer(-2));
        call(&mut keys, "HSET a f 1 g 2");
        assert_eq!(call(&mut keys, "PTTL a"), Reply::Integer(-1));
        assert_eq!(call(&mut keys, "PEXPIRE a 10"), Reply::Integer(1));
        keys.now = 9;
        assert_eq!(call(&mut keys, "PTTL a"), Reply::Integer(1));
        assert_eq!(call(&mut keys, "HINCRBY a f 2"), Reply::Integer(3));
        call(&mut keys, "HSET b f 9");
        call(&mut keys, "RENAME a b");
        assert_eq!(call(&mut keys, "HGET b f"), Reply::Bulk(b"3".to_vec()));
        assert_eq!(call(&mut keys, "EXISTS a"), Reply::Integer(0));
        keys.now = 10;
        assert_eq!(call(&mut keys, "EXISTS b"), Reply::Integer(0));
        assert_eq!(call(&mut keys, "HGET b f"), Reply::Nil);
        assert!(keys.live_keys().is_empty());
    }

    #[test]
    fn members_are_in_the_order_of_their_scores() {
        let mut keys = Keyspace::default();
        for line in ["ZADD s 2 b", "ZADD s 1 c", "ZADD s 2 a", "ZADD s XX 9 d"] {
            call(&mut keys, line);
        }
        let list = |names: &[&str]| {
            let bulk = |name: &&str| Reply::Bulk(name.as_bytes().to_vec());
            Reply::List(names.iter().map(bulk).collect())
        };
        assert_eq!(call(&mut keys, "ZRANGE s 0 -1"), list(&["c", "a", "b"]));
        assert_eq!(call(&mut keys, "ZRANGE s 0 0"), list(&["c"]));
        call(&mut keys, "ZADD s XX 3 c");
        call(&mut keys, "ZREM s a");
        assert_eq!(call(&mut keys, "ZRANGE s 0 31"), list(&["b", "c"]));
    }

    #[test]
    fn a_command_on_another_type_is_refused() {
        let mut keys = Keyspace::default();
        call(&mut keys, "SET a 1 PX 5");
        assert!(
            keys.call(&[b"HGET".to_vec(), b"a".to_vec(), b"f".to_vec()])
                .is_err()
        );
    }
}
