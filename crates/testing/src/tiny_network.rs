//! A network with the inputs and outputs of NanoTrack that needs no training, as ONNX files: the backbone describes
//! each 16 x 16 pixels by their mean colour, the head finds where the middle of the target's description fits best. The
//! box keeps its size.

use std::path::Path;
use std::{fs, io};

/// Writes the network's two files into a folder; gives the setting that names them.
///
/// # Errors
/// The folder takes no files.
pub fn write(folder: &Path) -> io::Result<String> {
    let [backbone, head] = ["backbone.onnx", "head.onnx"].map(|name| folder.join(name));
    fs::write(&backbone, self::backbone())?;
    fs::write(&head, self::head())?;
    let setting = format!("nanotrack:{},{}", backbone.display(), head.display());
    Ok(setting)
}

/// The ONNX file of the backbone: a picture to its mean colours x, and -|x|²/2 beside them.
pub fn backbone() -> Vec<u8> {
    const SIDE: usize = 15;
    let mut means = vec![0.0; 3 * 3 * SIDE * SIDE];
    for channel in 0..3 {
        let weights = &mut means[(channel * 3 + channel) * SIDE * SIDE..][..SIDE * SIDE];
        weights.fill(1.0 / (SIDE * SIDE) as f32 / 32.0);
    }
    Graph::default()
        .constant("means", &[3, 3, SIDE, SIDE], &means)
        .constant("halves", &[1, 3, 1, 1], &[-0.5; 3])
        .node(
            "Conv",
            &["picture", "means"],
            "colors",
            &[("strides", &[16, 16])],
        )
        .node("Mul", &["colors", "colors"], "squares", &[])
        .node("Conv", &["squares", "halves"], "lengths", &[])
        .node(
            "Concat",
            &["colors", "lengths"],
            "described",
            &[("axis", &[1])],
        )
        .file(&["picture"], &["described"])
}

/// The ONNX file of the head: for each place -|x - t|²/2 over 2 x 2 cells, plus 3, as the logit of the target, and
/// edges as far away as those of a box that fills the middle of the target's picture.
pub fn head() -> Vec<u8> {
    Graph::default()
        .integers("starts", &[3, 3])
        .integers("ends", &[5, 5])
        .integers("axes", &[2, 3])
        .constant("colors only", &[1, 4, 1, 1], &[1.0, 1.0, 1.0, 0.0])
        .constant("one at the end", &[1, 4, 1, 1], &[0.0, 0.0, 0.0, 1.0])
        .constant("length of t", &[1, 4, 1, 1], &[0.0, 0.0, 0.0, 4.0])
        .constant("classes", &[2, 1, 1, 1], &[0.0, 1.0])
        .constant("bias of classes", &[2], &[0.0, 3.0])
        .constant("none", &[4, 1, 1, 1], &[0.0; 4])
        .constant("edges of the target", &[4], &[32.0; 4])
        .node(
            "Slice",
            &["target", "starts", "ends", "axes"],
            "middle",
            &[],
        )
        .node("Mul", &["middle", "colors only"], "t", &[])
        .node("Add", &["t", "one at the end"], "kernel", &[])
        .node("Conv", &["search", "kernel"], "products", &[])
        .node("GlobalAveragePool", &["middle"], "mean", &[])
        .node("Conv", &["mean", "length of t"], "length", &[])
        .node("Add", &["products", "length"], "fit", &[])
        .node(
            "Conv",
            &["fit", "classes", "bias of classes"],
            "answer",
            &[],
        )
        .node(
            "Conv",
            &["fit", "none", "edges of the target"],
            "edges",
            &[],
        )
        .file(&["target", "search"], &["answer", "edges"])
}

/// An ONNX file whose only operation is of this kind.
pub fn of_operation(kind: &str) -> Vec<u8> {
    Graph::default()
        .node(kind, &["picture"], "described", &[])
        .file(&["picture"], &["described"])
}

/// The encoded fields of a graph. Numbers of fields are those of `onnx.proto`.
#[derive(Default)]
struct Graph(Vec<u8>);

impl Graph {
    fn constant(mut self, name: &str, shape: &[usize], values: &[f32]) -> Self {
        let data: Vec<u8> = values
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        bytes(&mut self.0, 5, &tensor(name, shape, 1, &data));
        self
    }

    fn integers(mut self, name: &str, values: &[i64]) -> Self {
        let data: Vec<u8> = values
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        bytes(&mut self.0, 5, &tensor(name, &[values.len()], 7, &data));
        self
    }

    fn node(
        mut self,
        kind: &str,
        inputs: &[&str],
        output: &str,
        attributes: &[(&str, &[i64])],
    ) -> Self {
        let mut node = Vec::new();
        for input in inputs {
            bytes(&mut node, 1, input.as_bytes());
        }
        bytes(&mut node, 2, output.as_bytes());
        bytes(&mut node, 4, kind.as_bytes());
        for (name, values) in attributes {
            let mut attribute = Vec::new();
            bytes(&mut attribute, 1, name.as_bytes());
            match values {
                [value] => integer(&mut attribute, 3, value.unsigned_abs()),
                values => {
                    for value in *values {
                        integer(&mut attribute, 8, value.unsigned_abs());
                    }
                }
            }
            bytes(&mut node, 5, &attribute);
        }
        bytes(&mut self.0, 1, &node);
        self
    }

    fn file(mut self, inputs: &[&str], outputs: &[&str]) -> Vec<u8> {
        for (field, names) in [(11, inputs), (12, outputs)] {
            for name in names {
                let mut value = Vec::new();
                bytes(&mut value, 1, name.as_bytes());
                bytes(&mut self.0, field, &value);
            }
        }
        let mut model = Vec::new();
        bytes(&mut model, 7, &self.0);
        model
    }
}

fn tensor(name: &str, shape: &[usize], kind: u64, data: &[u8]) -> Vec<u8> {
    let mut tensor = Vec::new();
    for &side in shape {
        integer(&mut tensor, 1, side as u64);
    }
    integer(&mut tensor, 2, kind);
    bytes(&mut tensor, 8, name.as_bytes());
    bytes(&mut tensor, 9, data);
    tensor
}

fn integer(message: &mut Vec<u8>, field: u64, value: u64) {
    varint(message, field << 3);
    varint(message, value);
}

fn bytes(message: &mut Vec<u8>, field: u64, value: &[u8]) {
    varint(message, field << 3 | 2);
    varint(message, value.len() as u64);
    message.extend_from_slice(value);
}

fn varint(message: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        message.push((value & 0x7f) as u8 | 0x80);
        value >>= 7;
    }
    message.push(value as u8);
}
