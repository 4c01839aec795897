//! A folder of results in place of an older one: `cargo run --example report -- OUT INPUT..`.

use atomic_output::{Destination, write_text};

fn main() -> Result<(), atomic_output::Error> {
    let mut arguments = std::env::args_os().skip(1);
    let out = arguments.next().map_or_else(|| std::env::temp_dir().join("report"), std::path::PathBuf::from);
    let inputs: Vec<_> = arguments.collect();
    let output = Destination::new(&out, &inputs)?.open()?;
    write_text(output.file("summary.txt")?, "all is well\n")?;
    write_text(output.file("tables/values.csv")?, "x,y\n1,2\n")?;
    output.commit()
}
