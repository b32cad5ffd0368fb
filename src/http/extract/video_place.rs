//! Places for the processes that decode videos: a client has one at a time, so that another client gets the next.

use crate::http::problems::problem::Problem;
use crate::http::state::AppState;
use bagtrack_quotas::Client;
use bagtrack_sessions::clock;
use bagtrack_sessions::{QueueFull, QueuePermit};
use tokio::sync::OwnedSemaphorePermit;

/// A place for a process that decodes a video, given back when this is dropped.
#[derive(Debug)]
pub struct VideoPlace {
    _of_client: OwnedSemaphorePermit,
    _of_all: OwnedSemaphorePermit,
}

/// Waits until a frame of a video has a place in the client's quota of frames.
///
/// # Errors
/// It has none in the time that a request may take.
pub async fn count_frame(state: &AppState, client: &Client) -> Result<(), Problem> {
    let deadline = clock::now() + state.config.work_timeout;
    let account = state.clients.account(client);
    Ok(account.count_frame_in_order(deadline).await?)
}

impl VideoPlace {
    /// Waits for a place, as long as a request may. Meanwhile another request may have the place in the queue. A video
    /// may take the processor time of as many requests as its frames would be posted in.
    ///
    /// # Errors
    /// The client's other video, or those of others, take longer; or the queue is full after the wait.
    pub async fn take(
        state: &AppState,
        client: &Client,
        queue: QueuePermit,
    ) -> Result<(Self, QueuePermit), Problem> {
        let config = &state.config;
        let deadline = clock::now() + config.work_timeout;
        let request = queue.yield_place();
        let own = state.clients.account(client).video_until(deadline).await?;
        let all = state.videos.take_until(deadline).await.ok_or(QueueFull)?;
        let requests = config.limits.max_video_frames.div_ceil(config.max_frames);
        let requests = u32::try_from(requests).unwrap_or(u32::MAX);
        let queue = state.service.admission.rejoin(request)?;
        let place = Self {
            _of_client: own,
            _of_all: all,
        };
        Ok((place, queue.with_cpu_of(requests)))
    }
}
