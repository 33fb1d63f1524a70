//! The server of the page: one page, one stream of events, the newest frame, and a Stop.

use std::collections::VecDeque;
use std::hash::{BuildHasher, RandomState};
use std::io::Cursor;
use std::net::TcpListener;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, SystemTime};

use axum::Router;
use axum::body::Bytes;
use axum::extract::{Query, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{Html, IntoResponse};
use axum::routing::{get, post};
use futures_util::stream::{self, Stream};
use image::codecs::jpeg::JpegEncoder;
use image::{ImageEncoder, RgbImage};
use serde_json::Value;
use tokio::sync::watch;

use crate::program::{Outcome, STOP};

/// Events that are kept for viewers who come late.
const KEPT: usize = 5_000;

/// The server, in a thread of its own. It never waits for a viewer.
#[derive(Debug)]
pub(super) struct Server {
    shared: Arc<Shared>,
    url: String,
}

#[derive(Debug)]
struct Shared {
    /// Number of this program's run, by which a viewer who reconnects knows another one.
    session: u64,
    /// Needed to stop the arm; none on the loopback interface.
    token: Option<String>,
    told: Mutex<Told>,
    news: watch::Sender<()>,
}

#[derive(Debug, Default)]
struct Told {
    /// Number of events that are gone, all of them after the first one.
    gone: usize,
    events: VecDeque<String>,
    frame: (usize, Bytes),
}

impl Shared {
    fn told(&self) -> MutexGuard<'_, Told> {
        self.told.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Server {
    pub(super) fn start(address: &str) -> Outcome<Self> {
        let failed = |error| {
            format!(
                "the page cannot be served at {address}: {error}; choose another address with \
                 --live HOST:PORT, port 0 for any free one"
            )
        };
        let listener = TcpListener::bind(address).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let bound = listener.local_addr().map_err(failed)?;
        let token = (!bound.ip().is_loopback()).then(|| {
            // The keys of these hashers come from the system's random numbers.
            let word = || RandomState::new().hash_one(SystemTime::now());
            format!("{:016x}{:016x}", word(), word())
        });
        let url = match &token {
            Some(token) => format!("http://{bound}/?token={token}"),
            None => format!("http://{bound}/"),
        };
        let session = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH)?;
        let shared = Arc::new(Shared {
            session: session.as_millis() as u64,
            token,
            told: Mutex::default(),
            news: watch::channel(()).0,
        });
        let routes = Router::new()
            .route("/", get(|| async { Html(include_str!("page.html")) }))
            .route("/events", get(events))
            .route("/frame", get(frame))
            .route("/stop", post(stop))
            .with_state(Arc::clone(&shared));
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()?;
        thread::spawn(move || {
            runtime.block_on(async move {
                if let Ok(listener) = tokio::net::TcpListener::from_std(listener) {
                    let _ = axum::serve(listener, routes).await;
                }
            });
        });
        let server = Self { shared, url };
        server.tell(&serde_json::json!({ "type": "begin" }));
        Ok(server)
    }

    pub(super) fn url(&self) -> &str {
        &self.url
    }

    pub(super) fn tell(&self, event: &Value) {
        let mut told = self.shared.told();
        if told.events.len() == KEPT {
            // The first one, which begins the run, stays.
            told.events.remove(1);
            told.gone += 1;
        }
        told.events.push_back(event.to_string());
        self.shared.news.send_replace(());
    }

    /// Makes this frame the newest one. Returns its number.
    pub(super) fn show(&self, frame: &RgbImage) -> Option<usize> {
        let mut bytes = Cursor::new(Vec::new());
        let (width, height) = frame.dimensions();
        JpegEncoder::new_with_quality(&mut bytes, 80)
            .write_image(
                frame.as_raw(),
                width,
                height,
                image::ExtendedColorType::Rgb8,
            )
            .ok()?;
        let mut told = self.shared.told();
        told.frame = (told.frame.0 + 1, bytes.into_inner().into());
        Some(told.frame.0)
    }

    /// Waits a moment for viewers to receive the last events.
    pub(super) fn leave(&self) {
        if self.shared.news.receiver_count() > 0 {
            thread::sleep(Duration::from_millis(500));
        }
    }
}

/// Streams all events that are kept, then each new one. A viewer who is too slow misses events.
async fn events(
    State(shared): State<Arc<Shared>>,
    headers: HeaderMap,
) -> Sse<impl Stream<Item = Result<Event, axum::Error>>> {
    let last = headers.get("last-event-id").and_then(|id| id.to_str().ok());
    let seen = last.and_then(|id| id.split_once('-'));
    let seen = seen.filter(|(session, _)| *session == shared.session.to_string());
    let next = seen.and_then(|(_, number)| number.parse::<usize>().ok());
    let news = shared.news.subscribe();
    let begin = (shared, news, next.map_or(0, |number| number + 1));
    let stream = stream::unfold(begin, |(shared, mut news, next)| async move {
        loop {
            let found = {
                let told = shared.told();
                // The first event stays; of the others some may be gone.
                let number = if next == 0 {
                    0
                } else {
                    next.max(told.gone + 1)
                };
                let index = if next == 0 { 0 } else { number - told.gone };
                told.events.get(index).map(|event| (event.clone(), number))
            };
            if let Some((data, number)) = found {
                let id = format!("{}-{number}", shared.session);
                let event = Event::default().id(id).data(data);
                return Some((Ok(event), (shared, news, number + 1)));
            }
            news.changed().await.ok()?;
        }
    });
    Sse::new(stream).keep_alive(KeepAlive::default())
}

async fn frame(State(shared): State<Arc<Shared>>) -> impl IntoResponse {
    let bytes = shared.told().frame.1.clone();
    (
        [
            (header::CONTENT_TYPE, "image/jpeg"),
            (header::CACHE_CONTROL, "no-store"),
        ],
        bytes,
    )
}

#[derive(serde::Deserialize)]
struct Asked {
    token: Option<String>,
}

/// Stops the arm and ends the run. The header keeps pages of other origins from asking.
async fn stop(
    State(shared): State<Arc<Shared>>,
    Query(asked): Query<Asked>,
    headers: HeaderMap,
) -> (StatusCode, &'static str) {
    if !headers.contains_key("x-stop") {
        return (StatusCode::FORBIDDEN, "the header x-stop is missing");
    }
    if shared.token.is_some() && shared.token != asked.token {
        return (
            StatusCode::FORBIDDEN,
            "wrong token: open the address that the program printed",
        );
    }
    STOP.store(true, Ordering::Relaxed);
    (StatusCode::OK, "stopping")
}
