//! The page in a real browser, where there is one.

use std::process::Command;

use live_tasks::LiveTracking;

use crate::common::World;
use crate::page::Running;

#[test]
fn a_browser_draws_the_page() {
    let Some(browser) =
        ["/usr/bin/chromium", "/usr/bin/chromium-browser"].iter().find(|path| std::path::Path::new(path).exists())
    else {
        println!("no browser on this machine: the page is not drawn");
        return;
    };
    let world = World::moving("");
    let running = Running::asking(&world, Some(LiveTracking::default()));
    let profile = tempfile::tempdir().unwrap();
    let drawn = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run"])
        .args(["--timeout=8000", "--virtual-time-budget=3000", "--dump-dom"])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg(format!("http://{}/", running.address))
        .output()
        .unwrap();
    let page = String::from_utf8_lossy(&drawn.stdout).into_owned();
    running.end();
    if page.is_empty() {
        println!("the browser does not run here: {}", String::from_utf8_lossy(&drawn.stderr));
        return;
    }
    // Words that only the drawn frame has.
    assert!(page.contains(" points"), "{page}");
    assert!(page.contains(" processed · "), "{page}");
    assert!(page.contains("not calibrated"), "{page}");
    assert!(page.contains("tracked, σ ") && page.contains(" m, grid "), "{page}");
}
