//! One request of a browser.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use super::Shared;

const PAGE: &str = include_str!("page.html");
/// Longest head of a request, bytes; browsers send one or two thousand.
const LONGEST_HEAD: usize = 1 << 14;
/// Longest wait for a browser to send or to take something.
const PATIENCE: Duration = Duration::from_secs(5);

/// Answers one request and closes the connection.
pub(super) fn answer(mut connection: TcpStream, shared: &Shared) -> io::Result<()> {
    connection.set_read_timeout(Some(PATIENCE))?;
    connection.set_write_timeout(Some(PATIENCE))?;
    connection.set_nodelay(true)?;
    let head = read_head(&mut connection)?;
    let (status, kind, body) = response(&head, shared);
    let length = body.len();
    let answer = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nConnection: close\r\nCache-Control: no-store\r\n\
         X-Content-Type-Options: nosniff\r\nCross-Origin-Resource-Policy: same-origin\r\nContent-Security-Policy: default-src 'none'; \
         script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; img-src data:\r\n\r\n"
    );
    connection.write_all(answer.as_bytes())?;
    connection.write_all(&body)?;
    connection.flush()
}

fn response(head: &str, shared: &Shared) -> (&'static str, &'static str, Vec<u8>) {
    const TEXT: &str = "text/plain; charset=utf-8";
    let says = |status: &'static str| (status, TEXT, status.as_bytes().to_vec());
    let mut lines = head.lines();
    let mut words = lines.next().unwrap_or_default().split(' ');
    let (method, path) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
    // A page of another site that a name of its own leads here would be such a host.
    let mut hosts = lines.filter_map(|line| line.split_once(':')).filter(|(name, _)| name.eq_ignore_ascii_case("host"));
    let is_own = matches!((hosts.next(), hosts.next()), (Some((_, host)), None) if is_loopback(host.trim()));
    if !is_own {
        return says("403 Forbidden");
    }
    match (method, path) {
        ("GET", "/") => ("200 OK", "text/html; charset=utf-8", PAGE.as_bytes().to_vec()),
        ("GET", "/frame") => match shared.newest().frame.clone() {
            frame if frame.is_empty() => says("503 Service Unavailable"),
            frame => ("200 OK", "application/octet-stream", frame),
        },
        ("GET", "/status") => match shared.newest().status.clone() {
            status if status.is_empty() => says("503 Service Unavailable"),
            status => ("200 OK", "application/json", status.into_bytes()),
        },
        ("GET", _) => says("404 Not Found"),
        _ => says("405 Method Not Allowed"),
    }
}

/// Whether a `Host` names this machine.
fn is_loopback(host: &str) -> bool {
    let is_port = |text: &str| text.parse::<u16>().is_ok();
    ["127.0.0.1", "localhost", "[::1]"]
        .iter()
        .filter_map(|name| host.strip_prefix(name))
        .any(|rest| rest.is_empty() || rest.strip_prefix(':').is_some_and(is_port))
}

/// The head of a request, up to its empty line.
fn read_head(connection: &mut impl Read) -> io::Result<String> {
    let mut head = Vec::new();
    let mut block = [0; 1 << 10];
    while !head.windows(4).any(|end| end == b"\r\n\r\n") {
        let found = connection.read(&mut block)?;
        if found == 0 || head.len() > LONGEST_HEAD {
            return Err(ErrorKind::InvalidData.into());
        }
        head.extend_from_slice(&block[..found]);
    }
    String::from_utf8(head).map_err(|_| ErrorKind::InvalidData.into())
}
