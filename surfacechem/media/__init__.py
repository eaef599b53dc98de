"""Media between the bodies, with properties from other packages."""
