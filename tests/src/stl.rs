//! Binary STL as bytes, and text STL as text.

/// Bytes before the first record.
pub const PREFIX: usize = 84;

/// One record.
pub type Record = [u8; 50];
/// Three corners.
pub type Triangle = [[f32; 3]; 3];

/// The records of a binary STL whose length is what its count says.
///
/// # Panics
/// When it is not.
pub fn records(file: &[u8]) -> &[Record] {
    let count = u32::from_le_bytes(file[80..PREFIX].try_into().expect("four bytes"));
    let (records, rest) = file[PREFIX..].as_chunks();
    assert!(rest.is_empty() && records.len() as u64 == u64::from(count), "{count} promised, {} bytes there", file.len());
    records
}

/// A binary STL of these records.
pub fn file(header: &[u8], records: &[Record]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, 0);
    bytes.extend((records.len() as u32).to_le_bytes());
    bytes.extend(records.as_flattened());
    bytes
}

/// A binary STL of these triangles, with their normals and no attributes.
pub fn mesh(triangles: &[Triangle]) -> Vec<u8> {
    file(b"made by a test", &triangles.iter().map(|t| record(unit_normal(t), t, 0)).collect::<Vec<_>>())
}

/// One record of these parts.
pub fn record(normal: [f32; 3], corners: &Triangle, attribute: u16) -> Record {
    let mut record = [0; 50];
    let numbers = normal.iter().chain(corners.as_flattened());
    record.chunks_exact_mut(4).zip(numbers).for_each(|(bytes, number)| bytes.copy_from_slice(&number.to_le_bytes()));
    record[48..].copy_from_slice(&attribute.to_le_bytes());
    record
}

/// Normal and corners of a record.
pub fn numbers(record: &Record) -> [[f32; 3]; 4] {
    std::array::from_fn(|k| {
        std::array::from_fn(|axis| {
            let at = 12 * k + 4 * axis;
            f32::from_le_bytes(record[at..at + 4].try_into().expect("four bytes"))
        })
    })
}

/// Corners of a record.
pub fn corners(record: &Record) -> Triangle {
    let [_, a, b, c] = numbers(record);
    [a, b, c]
}

/// The attribute word of a record.
pub fn attribute(record: &Record) -> u16 {
    u16::from_le_bytes([record[48], record[49]])
}

/// By the right-hand rule, in double precision; zero for a triangle without area.
pub fn unit_normal(corners: &Triangle) -> [f32; 3] {
    let [a, b, c] = corners.map(|p| p.map(f64::from));
    let (u, v): ([f64; 3], [f64; 3]) = (std::array::from_fn(|k| b[k] - a[k]), std::array::from_fn(|k| c[k] - a[k]));
    let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
    if length > 0.0 { n.map(|x| (x / length) as f32) } else { [0.0; 3] }
}

/// A text STL of one solid.
pub fn text(name: &str, triangles: &[Triangle]) -> String {
    let mut text = format!("solid {name}\n");
    for t in triangles {
        let [x, y, z] = unit_normal(t);
        text += &format!("facet normal {x:e} {y:e} {z:e}\nouter loop\n");
        for [x, y, z] in t {
            text += &format!("vertex {x} {y} {z}\n");
        }
        text += "endloop\nendfacet\n";
    }
    text + &format!("endsolid {name}\n")
}

/// A box from `low` to `high`, closed, its 12 triangles counter-clockwise seen from outside.
pub fn cuboid(low: [f32; 3], high: [f32; 3]) -> Vec<Triangle> {
    // Corner k has the high x, y, z where bits 0, 1, 2 of k are set.
    let corner = |k: usize| std::array::from_fn(|axis| if k >> axis & 1 == 1 { high[axis] } else { low[axis] });
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).map(|t| t.map(corner)).collect()
}
