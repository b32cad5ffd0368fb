//! TODO-doc

pub(crate) mod augmentation;
pub(crate) mod background;
pub(crate) mod bag;
pub(crate) mod mahalanobis;
pub(crate) mod point_distance;
pub(crate) mod span;
pub(crate) mod subspace;
pub(crate) mod whitening;
