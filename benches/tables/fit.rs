//! How near measured times are to an expected order.

/// How a time is expected to grow with a size.
#[derive(Debug, Clone, Copy)]
pub enum Order {
    /// As a power of the size, beside what does not depend on it: a + b xⁿ.
    Power(i32),
    /// Not at all: a.
    Constant,
}

/// The times a + b xⁿ that are nearest to the measured ones by the squares of their ratios, with a, b ≥ 0.
#[derive(Debug, Clone, Copy)]
pub struct Fit {
    /// The power.
    order: Order,
    a: f64,
    b: f64,
}

impl Fit {
    /// Fits times in seconds at these sizes; at least one.
    pub fn of(order: Order, sizes: &[f64], times: &[f64]) -> Self {
        let fitted = |(a, b)| Self { order, a, b };
        // Relative errors: the unknowns a and b multiply 1 / t and xⁿ / t, and the right side is 1.
        let rows = sizes.iter().zip(times);
        let rows = rows.map(|(&x, &t)| (1.0 / t, order.of(x) / t));
        let (mut aa, mut ab, mut bb, mut a1, mut b1) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (u, v) in rows {
            aa += u * u;
            ab += u * v;
            bb += v * v;
            a1 += u;
            b1 += v;
        }
        let determinant = aa * bb - ab * ab;
        let a = (a1 * bb - b1 * ab) / determinant;
        let b = (b1 * aa - a1 * ab) / determinant;
        if matches!(order, Order::Constant) || b < 0.0 {
            fitted((a1 / aa, 0.0))
        } else if a < 0.0 {
            fitted((0.0, b1 / bb))
        } else {
            fitted((a, b))
        }
    }

    /// Seconds at this size.
    pub fn at(&self, size: f64) -> f64 {
        self.a + self.b * self.order.of(size)
    }

    /// The largest part by which a measured time is off.
    pub fn furthest(&self, sizes: &[f64], times: &[f64]) -> f64 {
        let off = sizes.iter().zip(times);
        off.map(|(&x, t)| (t / self.at(x) - 1.0).abs())
            .fold(0.0, f64::max)
    }

    /// In microseconds, as `12 + 3.4 N`, for a size that is called this.
    pub fn text(&self, size: &str) -> String {
        let (a, b) = (self.a * 1e6, self.b * 1e6);
        let power = match self.order {
            Order::Constant => return format!("{a:.0}"),
            Order::Power(1) => "",
            Order::Power(2) => "²",
            Order::Power(3) => "³",
            Order::Power(_) => "ⁿ",
        };
        format!("{a:.0} + {} {size}{power}", significant(b))
    }
}

impl Order {
    fn of(self, size: f64) -> f64 {
        match self {
            Self::Power(power) => size.powi(power),
            Self::Constant => 0.0,
        }
    }
}

/// Two significant digits.
fn significant(value: f64) -> String {
    let digits = (1.0 - value.max(1e-9).log10().floor()).max(0.0);
    format!("{value:.*}", digits as usize)
}
