//! What all drawings begin with.

/// Opening tag of a figure with its title in the first line: 22 pixels that the drawing leaves free at the top.
pub fn open_svg(title: &str, width: f64, height: f64) -> String {
    format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0} {height:.0}" width="{width:.0}" role="img"><title>{title}</title><text x="0" y="14" class="title">{title}</text>"#,
        title = escape(title)
    )
}

/// Text that may stand in HTML and SVG.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
