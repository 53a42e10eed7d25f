extends SceneTree
# What Godot makes of an imported scene: bones with their places, shapes, clips with their lengths.

func find(node, kind):
	if node.is_class(kind):
		return node
	for child in node.get_children():
		var found = find(child, kind)
		if found != null:
			return found
	return null

func _init():
	var scene = load("res://person.glb").instance()
	var skeleton = find(scene, "Skeleton")
	var bones = {}
	for i in range(skeleton.get_bone_count()):
		var place = skeleton.get_bone_global_pose(i).origin
		bones[skeleton.get_bone_name(i)] = [place.x, place.y, place.z]
	var mesh = find(scene, "MeshInstance").mesh
	var shapes = []
	for i in range(mesh.get_blend_shape_count()):
		shapes.append(mesh.get_blend_shape_name(i))
	var clips = {}
	var player = find(scene, "AnimationPlayer")
	for name in player.get_animation_list():
		clips[name] = player.get_animation(name).length
	print("TOLD ", JSON.print({"bones": bones, "shapes": shapes, "clips": clips}), " END")
	quit()
