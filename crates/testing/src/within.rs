//! Waiting for what does happen, unless what is tested is broken.

use std::time::Duration;

/// Longer than any test waits for something that does happen.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// The output of a future that ends soon: that of `what`.
pub async fn within<T>(future: impl Future<Output = T>, what: &str) -> T {
    let output = tokio::time::timeout(PATIENCE, future).await;
    output.unwrap_or_else(|_| panic!("not within a minute: {what}"))
}
