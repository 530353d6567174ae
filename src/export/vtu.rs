//! The XML file of VTK's unstructured grids (.vtu): points, cells, and fields on both.
//!
//! Numbers are stored as they are in memory, little-endian, in base64, behind their length in bytes (UInt64, which needs version 1.0).
//! The file version is 1.0: meshio (5.3) reads 0.1 and 1.0 and refuses all others, ParaView reads every version. Below 2.1 the points of
//! hexahedra of higher order are numbered in the older way, and VTK renumbers them as it reads: [`super::body`] writes that
//! way. meshio has no Bezier cells in any version: it reads networks, meshes and frames, not the exact body of a patch.

/// The version of the format.
const VERSION: &str = "1.0";

/// Type number of a cell between two points.
pub const LINE: u8 = 3;
/// Type number of a triangle.
pub const TRIANGLE: u8 = 5;
/// Type number of a quadrilateral.
pub const QUADRILATERAL: u8 = 9;
/// Type number of a tetrahedron.
pub const TETRAHEDRON: u8 = 10;
/// Type number of a hexahedron.
pub const HEXAHEDRON: u8 = 12;
/// Type number of a rational Bezier quadrilateral.
pub const BEZIER_QUADRILATERAL: u8 = 77;
/// Type number of a rational Bezier hexahedron.
pub const BEZIER_HEXAHEDRON: u8 = 79;

/// Field whose values are the weights of rational cells.
pub const RATIONAL_WEIGHTS: &str = "RationalWeights";
/// Field whose values are the three degrees of each cell.
pub const HIGHER_ORDER_DEGREES: &str = "HigherOrderDegrees";

/// The numbers of a field.
#[derive(Debug, Clone)]
pub enum Values {
    /// Real numbers.
    Float(Vec<f64>),
    /// Counts and indices.
    Integer(Vec<i64>),
    /// Cell types.
    Byte(Vec<u8>),
}

/// A named list with `components` numbers for each point or cell.
#[derive(Debug, Clone)]
pub struct Field {
    /// Its name in ParaView.
    pub name: String,
    /// Numbers for each point or cell.
    pub components: usize,
    /// All numbers.
    pub values: Values,
}

/// Cells between points.
#[derive(Debug, Clone, Default)]
pub struct Cells {
    /// Type number of each cell.
    pub types: Vec<u8>,
    /// Points of all cells, one cell after the other.
    pub connectivity: Vec<u32>,
    /// Where each cell ends in `connectivity`.
    pub ends: Vec<i64>,
}

impl Cells {
    /// Cells of one type with equally many points.
    pub fn equal(cell_type: u8, points_per_cell: usize, connectivity: Vec<u32>) -> Self {
        let cells = connectivity.len() / points_per_cell;
        Self {
            types: vec![cell_type; cells],
            ends: (1..=cells).map(|cell| (cell * points_per_cell) as i64).collect(),
            connectivity,
        }
    }

    /// Appends a cell.
    pub fn push(&mut self, cell_type: u8, points: &[u32]) {
        self.types.push(cell_type);
        self.connectivity.extend_from_slice(points);
        self.ends.push(self.connectivity.len() as i64);
    }
}

/// Points, cells between them, and fields.
#[derive(Debug, Clone)]
pub struct UnstructuredGrid {
    /// Points, m.
    pub points: Vec<[f64; 3]>,
    /// Cells.
    pub cells: Cells,
    /// Fields on the points.
    pub point_fields: Vec<Field>,
    /// Fields on the cells.
    pub cell_fields: Vec<Field>,
}

impl Field {
    /// One real number each.
    pub fn scalar(name: impl Into<String>, values: Vec<f64>) -> Self {
        Self { name: name.into(), components: 1, values: Values::Float(values) }
    }

    /// A vector each.
    pub fn vector(name: impl Into<String>, values: &[[f64; 3]]) -> Self {
        Self { name: name.into(), components: 3, values: Values::Float(values.as_flattened().to_vec()) }
    }

    /// One integer each.
    pub fn integer(name: impl Into<String>, values: Vec<i64>) -> Self {
        Self { name: name.into(), components: 1, values: Values::Integer(values) }
    }
}

/// The text of a .vtu file.
pub fn document(grid: &UnstructuredGrid) -> Vec<u8> {
    let cells = grid.cells.types.len();
    let mut text = String::from("<?xml version=\"1.0\"?>\n");
    text.push_str(&format!(
        "<VTKFile type=\"UnstructuredGrid\" version=\"{VERSION}\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
    ));
    let piece = format!("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{cells}\">", grid.points.len());
    text.push_str(&format!("<UnstructuredGrid>\n{piece}\n"));
    let connectivity = grid.cells.connectivity.iter().map(|&point| i64::from(point)).collect();
    let types = Field { name: "types".into(), components: 1, values: Values::Byte(grid.cells.types.clone()) };
    section(&mut text, "Points", &[Field::vector("Points", &grid.points)]);
    let structure =
        [Field::integer("connectivity", connectivity), Field::integer("offsets", grid.cells.ends.clone()), types];
    section(&mut text, "Cells", &structure);
    section(&mut text, "PointData", &grid.point_fields);
    section(&mut text, "CellData", &grid.cell_fields);
    text.push_str("</Piece>\n</UnstructuredGrid>\n</VTKFile>\n");
    text.into_bytes()
}

/// One element with its arrays. The two fields that VTK looks for by their role are named in its opening tag.
fn section(text: &mut String, tag: &str, fields: &[Field]) {
    text.push_str(&format!("<{tag}"));
    for role in [RATIONAL_WEIGHTS, HIGHER_ORDER_DEGREES] {
        if fields.iter().any(|field| field.name == role) {
            text.push_str(&format!(" {role}=\"{role}\""));
        }
    }
    text.push_str(">\n");
    for field in fields {
        array(text, field);
    }
    text.push_str(&format!("</{tag}>\n"));
}

fn array(text: &mut String, field: &Field) {
    let (kind, bytes) = match &field.values {
        Values::Float(values) => ("Float64", values.iter().flat_map(|x| x.to_le_bytes()).collect()),
        Values::Integer(values) => ("Int64", values.iter().flat_map(|x| x.to_le_bytes()).collect()),
        Values::Byte(values) => ("UInt8", values.clone()),
    };
    let (name, components) = (escaped(&field.name), field.components);
    text.push_str(&format!(
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"binary\">"
    ));
    let mut data = (bytes.len() as u64).to_le_bytes().to_vec();
    data.extend(bytes);
    base64(&data, text);
    text.push_str("</DataArray>\n");
}

/// Text inside an attribute. Characters that XML does not allow at all become spaces.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            character if character.is_control() => out.push(' '),
            character => out.push(character),
        }
    }
    out
}

/// Appends bytes in base64: three bytes are four letters, the last ones padded with `=`.
fn base64(bytes: &[u8], text: &mut String) {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    text.reserve(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for letter in 0..4 {
            let six = bits >> (18 - 6 * letter) & 63;
            text.push(if letter <= chunk.len() { char::from(LETTERS[six as usize]) } else { '=' });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rfc_4648_section_10_base64() {
        let encoded = |text: &str| {
            let mut out = String::new();
            base64(text.as_bytes(), &mut out);
            out
        };
        let expected = ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"];
        assert!((0..7).all(|n| encoded(&"foobar"[..n]) == expected[n]));
    }

    #[test]
    fn names_cannot_break_the_file() {
        assert_eq!(escaped("a<b> & \"c\"\n"), "a&lt;b&gt; &amp; &quot;c&quot; ");
    }
}
