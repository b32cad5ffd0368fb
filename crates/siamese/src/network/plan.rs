//! A graph in the order in which it runs.

use std::collections::HashMap;

use super::elementwise::{self, Broadcast};
use super::memory::Memory;
use super::operation::Operation;
use super::tensor::{Slot, Tensor};
use super::{convolution, product};
use crate::error::ModelError;
use crate::onnx::model::{Attribute, Graph, Node};

/// A network, ready to run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Plan {
    steps: Vec<Step>,
    /// Weights, sizes and indices, each in the slot where the steps look for it.
    constants: Vec<Slot>,
    inputs: Vec<usize>,
    outputs: Vec<usize>,
}

/// One operation: which slots it takes, and which it fills.
#[derive(Debug, Clone, PartialEq)]
struct Step {
    kind: String,
    operation: Operation,
    /// None for an input that is left out.
    inputs: Vec<Option<usize>>,
    output: usize,
    /// The slots that no later step takes.
    spent: Vec<usize>,
}

impl Plan {
    /// The network of `graph`.
    pub fn new(graph: Graph) -> Result<Self, ModelError> {
        let mut slots = Slots::default();
        let mut constants = Vec::new();
        for (name, constant) in graph.constants {
            constants.push((slots.of(&name), Slot::of(constant)));
        }
        let inputs: Vec<usize> = graph.inputs.iter().map(|name| slots.of(name)).collect();
        let mut steps = Vec::new();
        let mut is_known: Vec<usize> = constants.iter().map(|(slot, _)| *slot).collect();
        is_known.extend(&inputs);
        for node in &graph.nodes {
            let output = node.outputs.first().map(|name| slots.of(name));
            let output = output.ok_or(ModelError::NotOnnx("a node has no output"))?;
            if let Some(constant) = constant(node) {
                constants.push((output, constant));
            } else {
                steps.push(Step::new(node, output, &mut slots)?);
                let taken = steps.last().map(|step| &step.inputs);
                if taken
                    .into_iter()
                    .flatten()
                    .flatten()
                    .any(|slot| !is_known.contains(slot))
                {
                    return Err(ModelError::NotOnnx(
                        "a node takes what no node before it gives",
                    ));
                }
            }
            is_known.push(output);
        }
        let outputs: Vec<usize> = graph.outputs.iter().map(|name| slots.of(name)).collect();
        if outputs.iter().any(|slot| !is_known.contains(slot)) {
            return Err(ModelError::NotOnnx("no node gives an output of the graph"));
        }
        let mut plan = Self {
            steps,
            constants: vec![Slot::Empty; slots.0.len()],
            inputs,
            outputs,
        };
        for (slot, constant) in constants {
            plan.constants[slot] = constant;
        }
        plan.find_spent();
        Ok(plan)
    }

    /// How many tensors it takes, and how many it gives.
    pub fn arity(&self) -> (usize, usize) {
        (self.inputs.len(), self.outputs.len())
    }

    /// Notes for each step which computed tensors no later step takes.
    fn find_spent(&mut self) {
        let mut is_needed = vec![false; self.constants.len()];
        for &slot in &self.outputs {
            is_needed[slot] = true;
        }
        for step in self.steps.iter_mut().rev() {
            for slot in step.inputs.iter().flatten().copied() {
                if !is_needed[slot] && self.constants[slot] == Slot::Empty {
                    step.spent.push(slot);
                }
                is_needed[slot] = true;
            }
        }
    }

    /// The outputs for these inputs, in the order of the graph's outputs.
    pub fn run(&self, inputs: Vec<Tensor>, memory: &mut Memory) -> Result<Vec<Tensor>, ModelError> {
        let mut computed = vec![Slot::Empty; self.constants.len()];
        if inputs.len() != self.inputs.len() {
            return Err(ModelError::Unexpected("it takes another number of images"));
        }
        for (&slot, input) in self.inputs.iter().zip(inputs) {
            computed[slot] = Slot::Tensor(input);
        }
        for step in &self.steps {
            let run = Run {
                step,
                constants: &self.constants,
                computed: &mut computed,
                memory,
            };
            let tensor = run.compute().map_err(|reason| ModelError::Operation {
                kind: step.kind.clone(),
                reason,
            })?;
            for &slot in &step.spent {
                if let Slot::Tensor(tensor) = std::mem::replace(&mut computed[slot], Slot::Empty) {
                    memory.give_back(tensor.values);
                }
            }
            computed[step.output] = Slot::Tensor(tensor);
        }
        let mut outputs = Vec::new();
        for &slot in &self.outputs {
            let tensor = computed[slot].tensor().or(self.constants[slot].tensor());
            outputs.extend(tensor.cloned());
        }
        for slot in computed {
            if let Slot::Tensor(tensor) = slot {
                memory.give_back(tensor.values);
            }
        }
        Ok(outputs)
    }
}

/// The value of a node that is a constant.
fn constant(node: &Node) -> Option<Slot> {
    match node.attributes.get("value") {
        Some(Attribute::Tensor(tensor)) if node.kind == "Constant" => {
            Some(Slot::of(tensor.clone()))
        }
        _ => None,
    }
}

/// A slot for each name.
#[derive(Debug, Default)]
struct Slots(HashMap<String, usize>);

impl Slots {
    fn of(&mut self, name: &str) -> usize {
        let next = self.0.len();
        *self.0.entry(name.to_owned()).or_insert(next)
    }
}

impl Step {
    fn new(node: &Node, output: usize, slots: &mut Slots) -> Result<Self, ModelError> {
        let inputs = node.inputs.iter();
        let inputs = inputs.map(|name| (!name.is_empty()).then(|| slots.of(name)));
        Ok(Self {
            kind: node.kind.clone(),
            operation: Operation::of(node)?,
            inputs: inputs.collect(),
            output,
            spent: Vec::new(),
        })
    }
}

/// One step of a run. Its errors are reasons alone, without the operation's name.
struct Run<'a> {
    step: &'a Step,
    constants: &'a [Slot],
    computed: &'a mut Vec<Slot>,
    memory: &'a mut Memory,
}

const NO_TENSOR: &str = "an input is missing";
const NO_INTEGERS: &str = "its sizes must be constants";

impl Run<'_> {
    fn slot(&self, input: usize) -> Option<&Slot> {
        let slot = self.step.inputs.get(input).copied().flatten()?;
        match &self.computed[slot] {
            Slot::Empty => Some(&self.constants[slot]),
            computed => Some(computed),
        }
    }

    fn tensor(&self, input: usize) -> Result<&Tensor, &'static str> {
        self.slot(input).and_then(Slot::tensor).ok_or(NO_TENSOR)
    }

    /// A list of integers that is a constant of the graph; none where the input is left out.
    fn integers(&self, input: usize) -> Result<Option<Vec<i64>>, &'static str> {
        match self.slot(input) {
            None => Ok(None),
            Some(slot) => Ok(Some(slot.integers().ok_or(NO_INTEGERS)?.to_vec())),
        }
    }

    /// The tensor itself where no other step takes it, else a copy.
    fn owned(&mut self, input: usize) -> Result<Tensor, &'static str> {
        let slot = self
            .step
            .inputs
            .get(input)
            .copied()
            .flatten()
            .ok_or(NO_TENSOR)?;
        if self.step.spent.contains(&slot)
            && let Slot::Tensor(tensor) = std::mem::replace(&mut self.computed[slot], Slot::Empty)
        {
            return Ok(tensor);
        }
        let tensor = self.slot(input).and_then(Slot::tensor).ok_or(NO_TENSOR)?;
        let shape = tensor.shape.clone();
        let values = tensor.values.clone();
        Ok(Tensor { shape, values })
    }

    /// The first input with each number changed.
    fn map(mut self, function: impl Fn(f32) -> f32) -> Result<Tensor, &'static str> {
        let mut tensor = self.owned(0)?;
        elementwise::map(&mut tensor.values, function);
        Ok(tensor)
    }

    fn compute(mut self) -> Result<Tensor, &'static str> {
        match &self.step.operation {
            Operation::Conv(by) => {
                // The memory is lent to the convolution beside its inputs.
                let mut memory = std::mem::take(self.memory);
                let computed = self.convolve(by, &mut memory);
                *self.memory = memory;
                computed
            }
            &Operation::HardSigmoid { alpha, beta } => {
                self.map(|x| (alpha * x + beta).clamp(0.0, 1.0))
            }
            Operation::HardSwish => self.map(|x| x * (x / 6.0 + 0.5).clamp(0.0, 1.0)),
            Operation::Relu => self.map(|x| x.max(0.0)),
            Operation::Sigmoid => self.map(|x| 1.0 / (1.0 + (-x).exp())),
            Operation::Exp => self.map(f32::exp),
            Operation::Clip => {
                let bound = |input| self.tensor(input).ok().and_then(|it| it.values.first());
                let low = bound(1).copied().unwrap_or(f32::NEG_INFINITY);
                let high = bound(2).copied().unwrap_or(f32::INFINITY);
                self.map(|x| x.max(low).min(high))
            }
            Operation::GlobalAveragePool => elementwise::average(self.tensor(0)?),
            &Operation::Gemm { transposed } => {
                let bias = self.tensor(2).ok();
                product::gemm(self.tensor(0)?, self.tensor(1)?, transposed, bias)
            }
            Operation::MatMul => product::matmul(self.tensor(0)?, self.tensor(1)?),
            Operation::Add => self.combine(|sum, other| *sum += other),
            Operation::Mul => self.combine(|product, other| *product *= other),
            Operation::Reshape => {
                let shape = self.integers(1)?.ok_or(NO_INTEGERS)?;
                elementwise::reshaped(self.owned(0)?, &shape)
            }
            Operation::Transpose(order) => elementwise::transposed(self.tensor(0)?, order),
            Operation::Slice => {
                let [starts, ends] = [self.integers(1)?, self.integers(2)?];
                let [starts, ends] = [starts.ok_or(NO_INTEGERS)?, ends.ok_or(NO_INTEGERS)?];
                let [axes, steps] = [self.integers(3)?, self.integers(4)?];
                if steps.iter().flatten().any(|&step| step != 1) {
                    return Err("it leaves numbers out");
                }
                elementwise::sliced(self.tensor(0)?, &starts, &ends, axes.as_deref())
            }
            &Operation::Concat { axis } => {
                let parts: Result<Vec<_>, _> = (0..self.step.inputs.len())
                    .map(|input| self.tensor(input))
                    .collect();
                elementwise::concatenated(&parts?, axis)
            }
        }
    }

    fn convolve(
        &self,
        by: &super::operation::Convolution,
        memory: &mut Memory,
    ) -> Result<Tensor, &'static str> {
        let bias = self.tensor(2).ok();
        convolution::convolve(self.tensor(0)?, self.tensor(1)?, bias, by, memory)
    }

    /// The first input combined with the second, of the same shape or a number for each channel.
    fn combine(mut self, combine: impl Fn(&mut f32, f32)) -> Result<Tensor, &'static str> {
        let is_swapped = {
            let (first, second) = (self.tensor(0)?, self.tensor(1)?);
            first.values.len() < second.values.len()
        };
        let (larger, smaller) = if is_swapped { (1, 0) } else { (0, 1) };
        let broadcast = Broadcast::of(self.tensor(larger)?, self.tensor(smaller)?)?;
        if self.step.inputs[0] == self.step.inputs[1] {
            let other = self.tensor(0)?.clone();
            let mut tensor = self.owned(0)?;
            elementwise::combine(&mut tensor.values, &other.values, broadcast, combine);
            return Ok(tensor);
        }
        let mut tensor = self.owned(larger)?;
        let other = self.tensor(smaller)?;
        elementwise::combine(&mut tensor.values, &other.values, broadcast, combine);
        Ok(tensor)
    }
}
