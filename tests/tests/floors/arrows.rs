//! Arrows between the modules of a crate, and their cycles.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::modules::{Modules, Name, Read};

/// Where a path leads.
#[derive(Clone, Copy)]
enum Place {
    Module(usize),
    /// The module that defines an item, or in which a macro makes one.
    Item(usize),
}

/// Which module names items of which other, and by what paths.
type Arrows = BTreeMap<(usize, usize), BTreeSet<String>>;

/// A crate's modules with the arrows between them.
pub struct Graph {
    modules: Modules,
    pub arrows: Arrows,
}

/// Paths that are being resolved: a glob may lead back to its own module.
type Way = Vec<(usize, Name)>;

impl Modules {
    /// Where a path of a module leads; none out of the crate.
    fn resolve(&self, from: usize, path: &[String], way: &mut Way) -> Option<Place> {
        let step = (from, path.to_vec());
        if way.contains(&step) {
            return None;
        }
        way.push(step);
        let found = match path[0].as_str() {
            "crate" => self.walk(0, &path[1..], way),
            "self" => self.walk(from, &path[1..], way),
            "super" => self.walk(from, path, way),
            first => match self.look(from, first, path.len() > 1, way) {
                Some(Place::Module(module)) => self.walk(module, &path[1..], way),
                found => found,
            },
        };
        way.pop();
        found
    }

    /// Where a path leads that goes on from within a module.
    fn walk(&self, from: usize, path: &[String], way: &mut Way) -> Option<Place> {
        let Some(first) = path.first() else { return Some(Place::Module(from)) };
        if first == "super" {
            return self.walk(self.all[from].parent?, &path[1..], way);
        }
        match self.look(from, first, path.len() > 1, way) {
            Some(Place::Module(module)) => self.walk(module, &path[1..], way),
            // Re-exported from another crate.
            None if self.all[from].imports.contains_key(first) => None,
            found => found.or(Some(Place::Item(from))),
        }
    }

    /// What a word is in a module: where a path goes on behind it, a module rather than an item of that name.
    fn look(&self, module: usize, word: &str, goes_on: bool, way: &mut Way) -> Option<Place> {
        let here = &self.all[module];
        let child = here.children.get(word).map(|child| Place::Module(*child));
        let item = here.items.contains(word).then_some(Place::Item(module));
        if let Some(own) = if goes_on { child.or(item) } else { item.or(child) } {
            return Some(own);
        }
        let imports = here.imports.get(word).into_iter().flatten();
        let brought: Vec<Place> = imports.filter_map(|path| self.resolve(module, path, way)).collect();
        let fits = |place: &&Place| matches!(place, Place::Module(_)) == goes_on;
        brought.iter().find(fits).or(brought.first()).copied().or_else(|| self.by_glob(module, word, goes_on, way))
    }

    fn by_glob(&self, module: usize, word: &str, goes_on: bool, way: &mut Way) -> Option<Place> {
        self.all[module].globs.iter().find_map(|path| {
            let Place::Module(from) = self.resolve(module, path, way)? else { return None };
            let step = (from, vec![word.to_owned()]);
            if way.contains(&step) {
                return None;
            }
            way.push(step);
            let found = self.look(from, word, goes_on, way);
            way.pop();
            found
        })
    }

    fn arrows(&self) -> Arrows {
        let mut arrows = Arrows::new();
        for (number, module) in self.all.iter().enumerate().filter(|(_, module)| !module.test) {
            // A single word is defined here or brought by `use`, which has an arrow, unless it comes with a whole module.
            let words = module.words.iter().filter(|_| !module.globs.is_empty()).map(|word| vec![word.clone()]);
            for path in module.paths.iter().cloned().chain(words) {
                if let Some(Place::Item(to)) = self.resolve(number, &path, &mut Way::new())
                    && to != number
                {
                    arrows.entry((number, to)).or_default().insert(path.join("::"));
                }
            }
        }
        arrows
    }

    /// A module with those that it is nested in, the root first.
    fn ancestry(&self, module: usize) -> Vec<usize> {
        let mut line = self.all[module].parent.map(|parent| self.ancestry(parent)).unwrap_or_default();
        line.push(module);
        line
    }
}

impl Graph {
    /// Of the crate that begins with a file.
    pub fn of(root: &Path, read: Read) -> Self {
        let modules = Modules::of(root, read);
        Self { arrows: modules.arrows(), modules }
    }

    /// Files of the crate.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        let own = self.modules.all.iter().map(|module| module.file.as_path());
        own.chain(self.modules.included.iter().map(PathBuf::as_path))
    }

    /// Cycles of modules that are beside each other, each as its arrows, a line each.
    pub fn cycles(&self) -> Vec<String> {
        // From child to child of one module, with the arrows between what is nested in them.
        let mut beside: BTreeMap<(usize, usize), Vec<(usize, usize)>> = BTreeMap::new();
        for (from, to) in self.arrows.keys() {
            let [a, b] = [*from, *to].map(|module| self.modules.ancestry(module));
            let apart = a.iter().zip(&b).find(|(a, b)| a != b);
            if let Some((a, b)) = apart {
                beside.entry((*a, *b)).or_default().push((*from, *to));
            }
        }
        let (mut cycles, mut done) = (Vec::new(), BTreeSet::new());
        for (from, _) in beside.keys() {
            let cycle: BTreeSet<usize> =
                reached(&beside, *from).into_iter().filter(|other| reached(&beside, *other).contains(from)).collect();
            if !cycle.is_empty() && done.is_disjoint(&cycle) {
                let inside = beside.iter().filter(|((a, b), _)| cycle.contains(a) && cycle.contains(b));
                cycles.push(
                    inside.flat_map(|(_, arrows)| arrows).fold(String::new(), |text, arrow| text + &self.shown(*arrow)),
                );
                done.extend(cycle);
            }
        }
        cycles
    }

    fn shown(&self, arrow: (usize, usize)) -> String {
        let [from, to] = [arrow.0, arrow.1].map(|module| self.modules.all[module].file.display());
        let names: Vec<&str> = self.arrows[&arrow].iter().map(String::as_str).collect();
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "  {from} -> {to}: {}", names.join(", "));
        text
    }
}

/// All that can be reached by an arrow or more.
pub fn reached<T>(arrows: &BTreeMap<(usize, usize), T>, from: usize) -> BTreeSet<usize> {
    let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(at) = open.pop() {
        let next = arrows.range((at, 0)..=(at, usize::MAX)).map(|((_, to), _)| *to);
        open.extend(next.filter(|to| seen.insert(*to)));
    }
    seen
}
