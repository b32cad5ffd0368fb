//! The graph in an ONNX file. Numbers of fields are those of `onnx.proto`.

use std::collections::HashMap;

use super::protobuf::{self, Value};
use crate::error::ModelError;

/// Numbers with a shape.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Constant {
    pub shape: Vec<usize>,
    pub data: Data,
}

/// What a constant holds: weights, or sizes and indices.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Data {
    Floats(Vec<f32>),
    Integers(Vec<i64>),
}

/// An attribute of a node.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Attribute {
    Float(f32),
    Integer(i64),
    Integers(Vec<i64>),
    Text(String),
    Tensor(Constant),
}

/// An operation, with the names of the values that it takes and gives. An input left out has an empty name.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Node {
    pub kind: String,
    pub inputs: Vec<String>,
    pub outputs: Vec<String>,
    pub attributes: HashMap<String, Attribute>,
}

/// A network as it is in the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Graph {
    pub nodes: Vec<Node>,
    pub constants: Vec<(String, Constant)>,
    pub inputs: Vec<String>,
    pub outputs: Vec<String>,
}

const FLOAT: u64 = 1;
const INT32: u64 = 6;
const INT64: u64 = 7;

impl Graph {
    /// The graph of the ONNX file `bytes`.
    pub fn parse(bytes: &[u8]) -> Result<Self, ModelError> {
        let graph = protobuf::fields(bytes)?
            .into_iter()
            .find_map(|field| match field {
                (7, Value::Bytes(graph)) => Some(graph),
                _ => None,
            });
        let graph = graph.ok_or(ModelError::NotOnnx("it has no graph"))?;
        let mut parsed = Self::default();
        for field in protobuf::fields(graph)? {
            match field {
                (1, Value::Bytes(node)) => parsed.nodes.push(parse_node(node)?),
                (5, Value::Bytes(tensor)) => parsed.constants.push(parse_tensor(tensor)?),
                (11, Value::Bytes(input)) => parsed.inputs.push(parse_name(input)?),
                (12, Value::Bytes(output)) => parsed.outputs.push(parse_name(output)?),
                _ => {}
            }
        }
        let constants = &parsed.constants;
        // Old files name their weights among the inputs.
        let is_given = |name: &String| constants.iter().all(|(constant, _)| constant != name);
        parsed.inputs.retain(is_given);
        Ok(parsed)
    }
}

/// The name of a graph's input or output.
fn parse_name(bytes: &[u8]) -> Result<String, ModelError> {
    for field in protobuf::fields(bytes)? {
        if let (1, Value::Bytes(name)) = field {
            return protobuf::text(name);
        }
    }
    Err(ModelError::NotOnnx("an input or output has no name"))
}

fn parse_node(bytes: &[u8]) -> Result<Node, ModelError> {
    let mut node = Node {
        kind: String::new(),
        inputs: Vec::new(),
        outputs: Vec::new(),
        attributes: HashMap::new(),
    };
    for field in protobuf::fields(bytes)? {
        match field {
            (1, Value::Bytes(name)) => node.inputs.push(protobuf::text(name)?),
            (2, Value::Bytes(name)) => node.outputs.push(protobuf::text(name)?),
            (4, Value::Bytes(kind)) => node.kind = protobuf::text(kind)?,
            (5, Value::Bytes(attribute)) => {
                let (name, value) = parse_attribute(attribute)?;
                node.attributes.extend(value.map(|value| (name, value)));
            }
            _ => {}
        }
    }
    Ok(node)
}

/// The name and the value of an attribute; none where it is of a type that no operation here takes.
fn parse_attribute(bytes: &[u8]) -> Result<(String, Option<Attribute>), ModelError> {
    let (mut name, mut value, mut integers) = (String::new(), None, Vec::new());
    for field in protobuf::fields(bytes)? {
        match field {
            (1, Value::Bytes(text)) => name = protobuf::text(text)?,
            (2, Value::Word(word)) => value = Some(Attribute::Float(f32::from_le_bytes(word))),
            (3, Value::Integer(integer)) => {
                value = Some(Attribute::Integer(integer.cast_signed()));
            }
            (4, Value::Bytes(text)) => value = Some(Attribute::Text(protobuf::text(text)?)),
            (5, Value::Bytes(tensor)) => value = Some(Attribute::Tensor(parse_tensor(tensor)?.1)),
            (8, Value::Integer(integer)) => integers.push(integer.cast_signed()),
            (8, Value::Bytes(packed)) => integers.extend(protobuf::integers(packed)?),
            _ => {}
        }
    }
    if !integers.is_empty() {
        value = Some(Attribute::Integers(integers));
    }
    Ok((name, value))
}

/// The name and the numbers of a tensor.
fn parse_tensor(bytes: &[u8]) -> Result<(String, Constant), ModelError> {
    let (mut name, mut shape, mut kind) = (String::new(), Vec::new(), 0);
    let (mut floats, mut integers, mut raw) = (Vec::new(), Vec::new(), None);
    for field in protobuf::fields(bytes)? {
        match field {
            (1, Value::Integer(side)) => shape.push(side.cast_signed()),
            (1, Value::Bytes(packed)) => shape.extend(protobuf::integers(packed)?),
            (2, Value::Integer(of)) => kind = of,
            (4, Value::Word(word)) => floats.push(f32::from_le_bytes(word)),
            (4, Value::Bytes(packed)) => floats.extend(floats_of(packed)),
            (5 | 7, Value::Integer(integer)) => integers.push(integer.cast_signed()),
            (5 | 7, Value::Bytes(packed)) => integers.extend(protobuf::integers(packed)?),
            (8, Value::Bytes(text)) => name = protobuf::text(text)?,
            (9, Value::Bytes(bytes)) => raw = Some(bytes),
            _ => {}
        }
    }
    let data = match (kind, raw) {
        (FLOAT, None) => Data::Floats(floats),
        (FLOAT, Some(raw)) => Data::Floats(floats_of(raw).collect()),
        (INT32 | INT64, None) => Data::Integers(integers),
        (INT64, Some(raw)) => {
            let words = raw.as_chunks::<8>().0;
            Data::Integers(words.iter().map(|&word| i64::from_le_bytes(word)).collect())
        }
        _ => {
            return Err(ModelError::NotOnnx(
                "a tensor is neither of f32 nor of integers",
            ));
        }
    };
    let sides = shape.iter().map(|&side| usize::try_from(side));
    let shape = sides.collect::<Result<Vec<_>, _>>();
    let shape = shape.map_err(|_| ModelError::NotOnnx("a tensor has a negative size"))?;
    let expected = shape
        .iter()
        .try_fold(1_usize, |len, &side| len.checked_mul(side));
    let len = match &data {
        Data::Floats(values) => values.len(),
        Data::Integers(values) => values.len(),
    };
    if expected != Some(len) {
        return Err(ModelError::NotOnnx(
            "a tensor has more or fewer numbers than its shape",
        ));
    }
    Ok((name, Constant { shape, data }))
}

fn floats_of(bytes: &[u8]) -> impl Iterator<Item = f32> + '_ {
    let words = bytes.as_chunks::<4>().0;
    words.iter().map(|&word| f32::from_le_bytes(word))
}
