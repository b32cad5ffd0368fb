//! Streams of sessions with large frames that say nothing, or nothing more after one message.

use crate::good::GoodClients;
use crate::target::Target;
use crate::{Options, Outcome, Verdict};
use futures_util::{SinkExt, StreamExt};
use image::{DynamicImage, GrayImage, ImageFormat};
use std::io::Cursor;
use tokio::net::TcpStream;
use tokio_tungstenite::client_async;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;

const ADDRESSES: usize = 12;
const STREAMS: usize = 60;

pub async fn attack(target: &Target, options: &Options) -> Outcome<Verdict> {
    let mut frame = Cursor::new(Vec::new());
    let picture = DynamicImage::ImageLuma8(GrayImage::from_fn(4000, 3000, |x, y| {
        image::Luma([((x / 50) ^ (y / 40)) as u8])
    }));
    picture.write_to(&mut frame, ImageFormat::Png)?;
    let frame = frame.into_inner();
    let mut streams = Vec::new();
    for number in 0..STREAMS {
        let client = format!("198.51.100.{}", number % ADDRESSES);
        let query = "box=1000,1000,500,400";
        let path = target.open_with(&client, &frame, query).await?;
        let url = format!("ws://{}{path}/stream", target.address);
        let mut request = url.into_client_request()?;
        request
            .headers_mut()
            .insert("x-forwarded-for", client.parse()?);
        let connection = TcpStream::connect(target.address).await?;
        let (mut stream, _) = client_async(request, connection).await?;
        stream.next().await.ok_or("no greeting")??;
        // A message of the largest size, which is no image.
        stream.send(Message::binary(vec![0; 12 << 20])).await?;
        stream.next().await.ok_or("no answer")??;
        streams.push(stream);
    }
    let good = GoodClients::start(target, 4).await?;
    let ready = target
        .http
        .get(format!("{}/readyz", target.url))
        .send()
        .await?;
    tokio::time::sleep(options.duration()).await;
    let (kept, memory) = target.peak();
    let resident = target.memory("VmRSS:").map_or(0, |bytes| bytes >> 20);
    drop(streams);
    let seen = format!(
        "{STREAMS} streams after a message of 12 MiB each, readyz {}, {resident} MiB resident now, {memory}",
        ready.status()
    );
    // Without the limit, these streams would keep 720 MiB.
    let holds = kept && ready.status().is_success() && (!target.is_own() || resident < 400);
    good.verdict(holds, seen).await
}
