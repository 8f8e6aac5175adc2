//! From reversal-curve records to Everett tables.
