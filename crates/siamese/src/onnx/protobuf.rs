//! The wire format of protocol buffers: a message is a row of fields, each with a number and a value.

use crate::error::ModelError;

/// The value of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Value<'a> {
    Integer(u64),
    /// A text, a message inside this one, or packed numbers.
    Bytes(&'a [u8]),
    /// Four bytes, little-endian.
    Word([u8; 4]),
}

/// The fields of the message in `bytes`, in their order.
pub(crate) fn fields(bytes: &[u8]) -> Result<Vec<(u64, Value<'_>)>, ModelError> {
    let mut reader = Reader { rest: bytes };
    let mut fields = Vec::new();
    while !reader.rest.is_empty() {
        let tag = reader.integer()?;
        let value = match tag & 7 {
            0 => Value::Integer(reader.integer()?),
            1 => {
                reader.take(8)?;
                continue;
            }
            2 => {
                let len = reader.integer()?;
                Value::Bytes(reader.take(len)?)
            }
            5 => {
                let word = reader.take(4)?;
                Value::Word([word[0], word[1], word[2], word[3]])
            }
            _ => return Err(ModelError::NotOnnx("a field has an unknown type")),
        };
        fields.push((tag >> 3, value));
    }
    Ok(fields)
}

/// Integers one after the other, as a packed field has them.
pub(crate) fn integers(bytes: &[u8]) -> Result<Vec<i64>, ModelError> {
    let mut reader = Reader { rest: bytes };
    let mut values = Vec::new();
    while !reader.rest.is_empty() {
        values.push(reader.integer()?.cast_signed());
    }
    Ok(values)
}

pub(crate) fn text(bytes: &[u8]) -> Result<String, ModelError> {
    let text = str::from_utf8(bytes).map_err(|_| ModelError::NotOnnx("a name is not UTF-8"))?;
    Ok(text.to_owned())
}

struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    fn integer(&mut self) -> Result<u64, ModelError> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.take(1)?[0];
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(ModelError::NotOnnx("a number has more than 64 bits"))
    }

    fn take(&mut self, len: u64) -> Result<&'a [u8], ModelError> {
        let len = usize::try_from(len).unwrap_or(usize::MAX);
        let Some((taken, rest)) = self.rest.split_at_checked(len) else {
            return Err(ModelError::NotOnnx("it ends in the middle of a field"));
        };
        self.rest = rest;
        Ok(taken)
    }
}
