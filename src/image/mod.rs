//! Pictures on the CPU: linear Rec.709 pixels with named layers, their metrics and how they are displayed.

pub mod flip;
pub mod metrics;
pub mod tone;

/// A picture with its extra layers (AOVs). Values are linear, without exposure or tone map.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The first layer is the picture itself: name `""`, channels `R G B A`. The others are AOVs.
    pub layers: Vec<Layer>,
}

/// Some channels of the same name and size as the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// `""` for the picture, else the AOV: `transmittance`, `depth`, `albedo`, `single`, `multiple`, `variance`, `samples`.
    pub name: String,
    /// `R G B A`, `R G B`, `mean spread`, or one empty name where the layer's own name says it all.
    pub channels: Vec<String>,
    /// Interleaved: `channels.len()` values a pixel, pixels from the left, rows from the top.
    pub data: Vec<f32>,
}

impl Image {
    /// A picture of `width` × `height` pixels from its `R G B A` values, interleaved, rows from the top.
    pub fn from_rgba(width: u32, height: u32, data: Vec<f32>) -> Image {
        let channels = ["R", "G", "B", "A"].map(String::from).to_vec();
        Image { width, height, layers: vec![Layer { name: String::new(), channels, data }] }
    }

    /// The number of pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The layer of that name; `""` is the picture itself.
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|layer| layer.name == name)
    }

    /// Linear Rec.709 of every pixel of the picture itself, rows from the top.
    pub fn rgb(&self) -> impl ExactSizeIterator<Item = [f32; 3]> + Clone {
        self.layers[0].rgb()
    }

    /// Why this is not a whole picture: a missing first layer, or a layer with the wrong number of values.
    pub fn defect(&self) -> Option<String> {
        let Some(picture) = self.layers.first() else { return Some("It has no layers.".into()) };
        if picture.channels != ["R", "G", "B", "A"] {
            return Some(format!("Its first layer has the channels {:?}, not R G B A.", picture.channels));
        }
        if self.pixels() == 0 {
            return Some("It has no pixels.".into());
        }
        let wrong = self.layers.iter().find(|l| l.data.len() != self.pixels() * l.channels.len())?;
        Some(format!(
            "Layer {:?} has {} values for {}x{} pixels of {} channels.",
            wrong.name,
            wrong.data.len(),
            self.width,
            self.height,
            wrong.channels.len()
        ))
    }
}

impl Layer {
    /// The first three channels of every pixel, rows from the top. Panics with fewer than three channels.
    pub fn rgb(&self) -> impl ExactSizeIterator<Item = [f32; 3]> + Clone {
        self.data.chunks_exact(self.channels.len()).map(|pixel| [pixel[0], pixel[1], pixel[2]])
    }
}
