//! An overlay on the viewport with editors of all curves of the selected table.

use bansho::{
    base::parameters::{Descriptor, Kind, TableDescriptor, Value},
    scene::ValuePath,
};

use crate::{
    app::widgets::{
        curve_editor::{self, CurveBounds},
        key_label,
    },
    session::{Session, selection::Selection},
};
use eframe::egui::{self, Color32, Frame, Rect, Ui, vec2};

/// Width of one curve, points of the screen.
const WIDTH: f32 = 150.0;
/// Its height with its name.
const HEIGHT: f32 = 116.0;
/// Gap between two curves.
const GAP: f32 = 8.0;
/// Translucent background of the overlay and of each curve.
const BACKGROUND: Color32 = Color32::from_black_alpha(70);
/// Largest height as a fraction of the viewport; the rest scrolls.
const MAX_HEIGHT: f32 = 0.5;

/// Whether `selection` has any curves.
pub(crate) fn has_any(selection: &Selection) -> bool {
    fn any(table: &TableDescriptor) -> bool {
        table.parameters.iter().any(|parameter| match &parameter.kind {
            Kind::Curve { .. } => true,
            Kind::Table(inner) => any(inner()),
            _ => false,
        })
    }
    selection.descriptor().is_some_and(any)
}

/// Shows the curves along the lower edge of `viewport`, in rows.
pub(crate) fn curve_overlay_ui(ui: &mut Ui, session: &mut Session, selection: &Selection, viewport: Rect) {
    let Some(descriptor) = selection.descriptor() else { return };
    let mut curves = Vec::new();
    collect_curves(&selection.path(), descriptor, &mut curves);
    let columns = (((viewport.width() - GAP) / (WIDTH + GAP)) as usize).clamp(1, curves.len().max(1));
    let rows = curves.len().div_ceil(columns);
    let height = (rows as f32 * (HEIGHT + GAP) + GAP).min(MAX_HEIGHT * viewport.height());
    let corner = egui::pos2(viewport.left(), viewport.bottom() - height);
    let area = egui::Area::new(egui::Id::unique("curves")).order(egui::Order::Middle).fixed_pos(corner);
    area.constrain_to(viewport).show(ui.ctx(), |ui| {
        Frame::new().fill(BACKGROUND).inner_margin(0.5 * GAP).show(ui, |ui| {
            // The picture is dark in every theme.
            ui.visuals_mut().override_text_color = Some(Color32::from_gray(225));
            ui.visuals_mut().extreme_bg_color = BACKGROUND;
            egui::ScrollArea::vertical().max_height(height - GAP).show(ui, |ui| {
                egui::Grid::new("curves").spacing(vec2(GAP, GAP)).show(ui, |ui| {
                    for (index, (path, parameter)) in curves.iter().enumerate() {
                        curve_ui(ui, session, path, parameter);
                        if (index + 1) % columns == 0 {
                            ui.end_row();
                        }
                    }
                });
            });
        });
    });
}

/// Collects all curves of a table and of its sub-tables.
fn collect_curves(
    path: &ValuePath,
    table: &'static TableDescriptor,
    curves: &mut Vec<(ValuePath, &'static Descriptor)>,
) {
    for parameter in &table.parameters {
        let own = path.key(parameter.key);
        match &parameter.kind {
            Kind::Curve { .. } => curves.push((own, parameter)),
            Kind::Table(inner) => collect_curves(&own, inner(), curves),
            _ => {}
        }
    }
}

fn curve_ui(ui: &mut Ui, session: &mut Session, path: &ValuePath, parameter: &Descriptor) {
    let Kind::Curve { x, y, rising } = parameter.kind else { return };
    let stated = path.find(session.document.values()).map(|node| node.value.clone());
    let present: Option<Value> = stated.or_else(|| parameter.default.clone());
    ui.push_id(path, |ui| {
        ui.vertical(|ui| {
            ui.set_width(WIDTH);
            let label = ui.label(title(parameter)).on_hover_text(&parameter.doc).id;
            let edited = present
                .and_then(|value| curve_editor::curve_editor_ui(ui, label, &value, CurveBounds { x, y, rising }));
            if let Some(value) = edited {
                session.set(parameter.key, path, value);
            }
        });
    });
}

/// The name of a curve, preceded by the paper's symbol if its description starts with one: `V(w), eq. (4)`.
fn title(parameter: &Descriptor) -> String {
    let symbol = parameter.doc.split(',').next().filter(|symbol| symbol.len() <= 8 && symbol.contains('('));
    let symbol = symbol.or_else(|| parameter.doc.split(',').next().filter(|symbol| symbol.starts_with("1 - ")));
    match symbol {
        Some(symbol) => format!("{symbol}  {}", key_label(parameter.key)),
        None => key_label(parameter.key),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flame_sheet_shows_the_nine_curves_of_its_paper() {
        let sheet = Selection { key: "flame_sheet", index: Some(0) };
        assert!(has_any(&sheet) && !has_any(&Selection { key: "camera", index: None }));
        let mut curves = Vec::new();
        collect_curves(&sheet.path(), sheet.descriptor().unwrap(), &mut curves);
        let titles: Vec<String> = curves.iter().map(|(_, parameter)| title(parameter)).collect();
        for symbol in ["V(w)", "H(u)", "C(s)", "R(s)", "G(s)", "B(s)", "A(w)", "D(w)", "1 - F"] {
            assert_eq!(titles.iter().filter(|title| title.starts_with(symbol)).count(), 1, "{symbol}: {titles:?}");
        }
    }
}
