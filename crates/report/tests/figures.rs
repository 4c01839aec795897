use report::{
    Axes, CATEGORIES, ColourMap, Direction, Document, Edge, Figure, LineOfSight, Node, Scale, Series, StationCloud,
    cloud_figure, curves, deviation_figure, heat_map, histogram, raster_figure, rgb_figure, station_graph,
};

fn page(figures: Vec<Figure>) -> String {
    let mut document = Document::new("figures", "");
    document.figures(figures);
    document.html()
}

const SCALE: Scale = Scale { map: ColourMap::Sequential, low: 0.0, high: 4.0, unit: "mm" };

#[test]
fn charts_have_axes_units_and_legends_and_leave_gaps() {
    let axes = Axes { title: "Drift", x: "time, min", y: "change, mm" };
    let values = vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0)];
    let series = [Series { name: "block & means", colour: CATEGORIES[0], values }];
    let html = page(vec![curves(&axes, &series).caption("one < two")]);
    for part in ["time, min", "change, mm", "block &amp; means", "<figcaption>one &lt; two</figcaption>"] {
        assert!(html.contains(part), "{part}");
    }
    assert!(!html.contains("NaN"));
    let sets = [Series { name: "all", colour: CATEGORIES[1], values: vec![0.5, 0.7, f64::NAN] }];
    assert!(!page(vec![histogram(&axes, [0.0, 1.0], &sets)]).contains("NaN"));
}

#[test]
fn pictures_are_in_the_page_with_the_unit_of_their_scale() -> Result<(), report::Error> {
    let figures = vec![
        raster_figure("Range", 2, &[1.0, 2.0, f64::NAN, 4.0], &SCALE)?,
        rgb_figure("Flags", 1, &[1, 2, 3])?,
        deviation_figure(
            "Distances",
            &[[0.0; 3], [1.0, 2.0, 0.5]],
            &[1.0, 2.0],
            LineOfSight::two(&[[0.0; 3]])[0],
            &SCALE,
        )?,
        cloud_figure("Cloud", &[cloud()], Direction::above_and_side(2)[0])?,
    ];
    let html = page(figures);
    assert_eq!(html.matches("data:image/png;base64,").count(), 4);
    assert!(html.contains("4.00 mm"));
    Ok(())
}

fn cloud() -> StationCloud<'static> {
    StationCloud { name: "S1", points: vec![[0.0; 3], [1.0, 2.0, 0.5]], position: [0.5; 3] }
}

#[test]
fn a_picture_without_whole_rows_is_an_error() {
    let error = rgb_figure("Flags", 2, &[1, 2, 3]).unwrap_err();
    assert!(error.to_string().starts_with("report: figure Flags: "), "{error}");
}

#[test]
fn marked_pairs_have_a_frame_and_stations_their_names() {
    let names = ["c1".to_owned(), "a0".to_owned()];
    let matrix = [vec![1.0, -0.97], vec![-0.97, 1.0]];
    let marked = page(vec![heat_map("Correlations", &names, &matrix, |_, _| true)]);
    let plain = page(vec![heat_map("Correlations", &names, &matrix, |_, _| false)]);
    assert_eq!(marked.matches("stroke=\"#111\"").count(), 2);
    assert!(!plain.contains("stroke=\"#111\"") && plain.contains("-.97"));
    let nodes = [Node { name: "S1", at: [0.0, 0.0] }, Node { name: "S<2", at: [3.0, 0.0] }];
    let edges = [Edge { from: 0, to: 1, overlap: 0.5, rms_m: 0.002 }];
    assert!(page(vec![station_graph("Stations", &nodes, &edges)]).contains("S&lt;2"));
}
