//! Follows an object through a folder of frames, in the order of their names:
//!
//! ```sh
//! bagtrack sample --out clip
//! cargo run -p bagtrack-client --example follow -- http://127.0.0.1:8080 clip/img 44.1 101.4 46.1 57.6
//! ```
//!
//! Prints a line a frame: its number, the box, the score and the status. `BAGTRACK_API_KEY` may have an API key.

use bagtrack_client::{Client, OpenOptions, Rect};
use std::error::Error;
use std::path::PathBuf;

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [url, folder, numbers @ ..] = &arguments[..] else {
        return Err("follow URL FOLDER X Y WIDTH HEIGHT".into());
    };
    let numbers: Result<Vec<f64>, _> = numbers.iter().map(|number| number.parse()).collect();
    let [x, y, width, height] = numbers?[..] else {
        return Err("a box is four numbers: X Y WIDTH HEIGHT".into());
    };
    let files = std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path()));
    let mut files = files.collect::<std::io::Result<Vec<PathBuf>>>()?;
    files.sort();
    let (first, rest) = files.split_first().ok_or("the folder is empty")?;

    let mut client = Client::builder(url);
    if let Ok(key) = std::env::var("BAGTRACK_API_KEY") {
        client = client.api_key(&key);
    }
    let target = Rect::from([x, y, width, height]);
    let options = OpenOptions::new().seed(1);
    let first = std::fs::read(first)?;
    let mut session = client.build()?.open(first, target, &options).await?;
    for file in rest {
        let answer = session.track(std::fs::read(file)?).await?;
        let (frame, rect, score) = (answer.frame, answer.first.rect, answer.first.score);
        println!("{frame} {rect} {score} {:?}", answer.first.status);
    }
    session.end().await?;
    Ok(())
}
