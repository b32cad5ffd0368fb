//! Runs the scripts of the store as Redis does: each without interruption, in Lua 5.1.

use super::keyspace::{Keyspace, Reply};
use mlua::{Function, Lua, Table, Value, Variadic};
use std::cell::RefCell;
use std::collections::HashMap;

thread_local! {
    /// One Lua engine for all runs of a thread; each call lends it its keyspace.
    static ENGINE: Engine = Engine::new().expect("Lua starts");
    /// The keyspace on which a script runs; empty between scripts.
    static LENT: RefCell<Keyspace> = RefCell::default();
}

struct Engine {
    lua: Lua,
    scripts: RefCell<HashMap<String, Function>>,
}

/// Runs a script on this keyspace.
///
/// # Errors
/// The error of the script. Its writes before the error stay, as in Redis.
pub fn run(
    keyspace: &mut Keyspace,
    script: &str,
    keys: &[String],
    args: &[Vec<u8>],
) -> Result<redis::Value, String> {
    LENT.set(std::mem::take(keyspace));
    let answer = ENGINE.with(|engine| engine.run(script, keys, args));
    *keyspace = LENT.take();
    answer.map_err(|error| error.to_string())
}

impl Engine {
    fn new() -> mlua::Result<Self> {
        let lua = Lua::new();
        let call = lua.create_function(|lua, words: Variadic<Value>| {
            let words: mlua::Result<Vec<Vec<u8>>> = words.iter().map(word).collect();
            let reply =
                LENT.with_borrow_mut(|keys| keys.call(&words?).map_err(mlua::Error::external))?;
            to_lua(lua, reply)
        })?;
        let redis = lua.create_table()?;
        redis.set("call", call)?;
        lua.globals().set("redis", redis)?;
        Ok(Self {
            lua,
            scripts: RefCell::default(),
        })
    }

    fn run(&self, script: &str, keys: &[String], args: &[Vec<u8>]) -> mlua::Result<redis::Value> {
        let mut scripts = self.scripts.borrow_mut();
        let function = match scripts.get(script) {
            Some(function) => function.clone(),
            None => {
                let function = self.lua.load(script).into_function()?;
                scripts.insert(script.to_owned(), function.clone());
                function
            }
        };
        let bytes = |bytes: &[u8]| self.lua.create_string(bytes);
        let keys: mlua::Result<Vec<_>> = keys.iter().map(|key| bytes(key.as_bytes())).collect();
        let args: mlua::Result<Vec<_>> = args.iter().map(|arg| bytes(arg)).collect();
        self.lua.globals().set("KEYS", keys?)?;
        self.lua.globals().set("ARGV", args?)?;
        from_lua(function.call(())?)
    }
}

fn word(value: &Value) -> mlua::Result<Vec<u8>> {
    match value {
        Value::String(text) => Ok(text.as_bytes().to_vec()),
        Value::Integer(number) => Ok(number.to_string().into_bytes()),
        Value::Number(number) => Ok(number.to_string().into_bytes()),
        _ => Err(mlua::Error::external(
            "ERR Lua redis lib command arguments must be strings or integers",
        )),
    }
}

/// A command's reply as a Lua value, converted as Redis does: nil becomes `false`.
fn to_lua(lua: &Lua, reply: Reply) -> mlua::Result<Value> {
    Ok(match reply {
        Reply::Nil => Value::Boolean(false),
        Reply::Integer(number) => Value::Integer(number),
        Reply::Bulk(text) => Value::String(lua.create_string(text)?),
        Reply::List(list) => {
            let list: mlua::Result<Vec<Value>> =
                list.into_iter().map(|reply| to_lua(lua, reply)).collect();
            Value::Table(lua.create_sequence_from(list?)?)
        }
    })
}

/// A script's result as the client gets it, converted as Redis does: a list ends at its first `nil`, numbers lose their
/// fraction.
fn from_lua(value: Value) -> mlua::Result<redis::Value> {
    Ok(match value {
        Value::Boolean(true) => redis::Value::Int(1),
        Value::Integer(number) => redis::Value::Int(number),
        Value::Number(number) => redis::Value::Int(number as i64),
        Value::String(text) => redis::Value::BulkString(text.as_bytes().to_vec()),
        Value::Table(table) => redis::Value::Array(list(&table)?),
        _ => redis::Value::Nil,
    })
}

fn list(table: &Table) -> mlua::Result<Vec<redis::Value>> {
    table
        .sequence_values()
        .map(|value| from_lua(value?))
        .collect()
}
