-- Version 4: a daemon tells in which hot folders it looks for drops. Daemons of version 3 that run while it comes tell nothing of that, and go on.
ALTER TABLE lives ADD COLUMN keeps text[];
