"""How an assembly is built: order, blocking, the verdict of every stage, props, yard and colours."""
